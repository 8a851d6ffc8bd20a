#include "grapnel/text/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <span>
#include <utility>

#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// ---- Units by their symbols ----

struct Symbol {
  std::string_view name;
  std::array<int, 4> powers;        // of m, kg, s, rad
  std::string_view to_si, from_si;  // digits
  int to_exponent = 0, from_exponent = 0;
  bool takes_prefix = false;
};

// pi/180 and similar factors to 50 digits: a product, rounded once, is the double nearest to the exact value.
constexpr std::array kSymbols{
    Symbol{"m", {1, 0, 0, 0}, "1", "1", 0, 0, true},
    Symbol{"g", {0, 1, 0, 0}, "1", "1", -3, 3, true},
    Symbol{"t", {0, 1, 0, 0}, "1", "1", 3, -3},
    Symbol{"s", {0, 0, 1, 0}, "1", "1", 0, 0, true},
    Symbol{"min", {0, 0, 1, 0}, "60", "16666666666666666666666666666666666666666666666667", 0, -51},
    Symbol{"h", {0, 0, 1, 0}, "3600", "27777777777777777777777777777777777777777777777778", 0, -53},
    Symbol{"Hz", {0, 0, -1, 0}, "1", "1", 0, 0, true},
    Symbol{"rad", {0, 0, 0, 1}, "1", "1", 0, 0, true},
    Symbol{"deg",
           {0, 0, 0, 1},
           "17453292519943295769236907684886127134428718885417",
           "57295779513082320876798154814105170332405472466564",
           -51,
           -48},
    Symbol{"\u00b0",
           {0, 0, 0, 1},
           "17453292519943295769236907684886127134428718885417",
           "57295779513082320876798154814105170332405472466564",
           -51,
           -48},
    Symbol{"arcmin",
           {0, 0, 0, 1},
           "29088820866572159615394846141476878557381198142362",
           "34377467707849392526078892888463102199443283479939",
           -53,
           -46},
    Symbol{"arcsec",
           {0, 0, 0, 1},
           "48481368110953599358991410235794797595635330237270",
           "20626480624709635515647335733077861319665970087963",
           -55,
           -44},
    Symbol{"rev",
           {0, 0, 0, 1},
           "62831853071795864769252867665590057683943387987502",
           "15915494309189533576888376337251436203445964574046",
           -49,
           -50},
    Symbol{"rpm",
           {0, 0, -1, 1},
           "10471975511965977461542144610931676280657231331250",
           "95492965855137201461330258023508617220675787444274",
           -50,
           -49},
    Symbol{"N", {1, 1, -2, 0}, "1", "1", 0, 0, true},
    Symbol{"Nm", {2, 1, -2, 0}, "1", "1", 0, 0, true},
    Symbol{"Ns", {1, 1, -1, 0}, "1", "1", 0, 0, true},
    Symbol{"Nms", {2, 1, -1, 0}, "1", "1", 0, 0, true},
    Symbol{"Pa", {-1, 1, -2, 0}, "1", "1", 0, 0, true},
    Symbol{"J", {2, 1, -2, 0}, "1", "1", 0, 0, true},
    Symbol{"W", {2, 1, -3, 0}, "1", "1", 0, 0, true},
};

struct Prefix {
  std::string_view name;
  int exponent;
};
constexpr std::array kPrefixes{Prefix{"da", 1},      Prefix{"n", -9}, Prefix{"u", -6}, Prefix{"\u00b5", -6},
                               Prefix{"\u03bc", -6}, Prefix{"m", -3}, Prefix{"c", -2}, Prefix{"d", -1},
                               Prefix{"k", 3},       Prefix{"M", 6},  Prefix{"G", 9}};

// Other spellings of supported units.
struct Alias {
  std::string_view written, meant;
};
constexpr std::array kAliases{
    Alias{"degree", "deg"},  Alias{"degrees", "deg"},   Alias{"radian", "rad"},    Alias{"radians", "rad"},
    Alias{"sec", "s"},       Alias{"second", "s"},      Alias{"seconds", "s"},     Alias{"minute", "min"},
    Alias{"minutes", "min"}, Alias{"hour", "h"},        Alias{"hours", "h"},       Alias{"hr", "h"},
    Alias{"meter", "m"},     Alias{"meters", "m"},      Alias{"metre", "m"},       Alias{"metres", "m"},
    Alias{"kgs", "kg"},      Alias{"kilogram", "kg"},   Alias{"kilograms", "kg"},  Alias{"gram", "g"},
    Alias{"grams", "g"},     Alias{"ton", "t"},         Alias{"tons", "t"},        Alias{"tonne", "t"},
    Alias{"tonnes", "t"},    Alias{"newton", "N"},      Alias{"newtons", "N"},     Alias{"kgm^2", "kg m^2"},
    Alias{"kgm2", "kg m^2"}, Alias{"dps", "deg/s"},     Alias{"mps", "m/s"},       Alias{"RPM", "rpm"},
    Alias{"m/sec", "m/s"},   Alias{"deg/sec", "deg/s"}, Alias{"rad/sec", "rad/s"}, Alias{"kph", "km/h"},
    Alias{"turn", "rev"},    Alias{"turns", "rev"},     Alias{"r/min", "rpm"},     Alias{"rev/minute", "rpm"}};

// ---- Decimal numbers ----

constexpr std::size_t kDigits = 60;  // digits of a product, far more than a double has

DecimalFactor product(const DecimalFactor& a, const DecimalFactor& b) {
  std::vector<int> sum(a.digits.size() + b.digits.size(), 0);
  for (std::size_t i = a.digits.size(); i-- > 0;) {
    int carry = 0;
    for (std::size_t j = b.digits.size(); j-- > 0;) {
      int& digit = sum[i + j + 1];
      carry += digit + (a.digits[i] - '0') * (b.digits[j] - '0');
      digit = carry % 10, carry /= 10;
    }
    sum[i] += carry;
  }
  DecimalFactor result{{}, a.exponent + b.exponent};
  for (const int digit : sum) {
    if (digit != 0 || !result.digits.empty()) result.digits += static_cast<char>('0' + digit);
  }
  if (result.digits.empty()) return {"0", 0};
  if (result.digits.size() > kDigits) {
    result.exponent += static_cast<int>(result.digits.size() - kDigits);
    result.digits.resize(kDigits);
  }
  return result;
}

// The double nearest to a number in the grammar of files times a factor; infinite or zero outside the range.
double scaled(std::string_view number, const DecimalFactor& factor) {
  const bool negative = number.starts_with('-');
  if (negative || number.starts_with('+')) number.remove_prefix(1);
  DecimalFactor value{{}, 0};
  const std::size_t e = std::min(number.find_first_of("eE"), number.size());
  bool behind_point = false;
  for (const char c : number.substr(0, e)) {
    if (c == '.') {
      behind_point = true;
      continue;
    }
    value.digits += c;
    if (behind_point) --value.exponent;
  }
  if (e < number.size()) {
    std::string_view power = number.substr(e + 1);
    if (power.starts_with('+')) power.remove_prefix(1);
    int exponent = 0;
    // A power outside the range of int is outside the range of a double too.
    if (std::from_chars(power.data(), power.data() + power.size(), exponent).ec != std::errc())
      exponent = power.starts_with('-') ? -100000 : 100000;
    value.exponent += std::clamp(exponent, -100000, 100000);
  }
  const DecimalFactor whole = product(value, factor);
  const std::string text = fmt::format("{}{}e{}", negative ? "-" : "", whole.digits, whole.exponent);
  return std::strtod(text.c_str(), nullptr);  // rounds to nearest
}

// ---- Products of units ----

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

// Removes one of the texts from the beginning.
bool take(std::string_view& text, std::string_view beginning) {
  if (!text.starts_with(beginning)) return false;
  text.remove_prefix(beginning.size());
  return true;
}

constexpr std::string_view kSuperscripts[] = {"\u2070", "\u00b9", "\u00b2", "\u00b3", "\u2074",
                                              "\u2075", "\u2076", "\u2077", "\u2078", "\u2079"};

bool starts_with_superscript(std::string_view text) {
  return text.starts_with("\u207b") || std::any_of(std::begin(kSuperscripts), std::end(kSuperscripts),
                                                   [&](std::string_view s) { return text.starts_with(s); });
}

// "^2", "^-1", "^1.5", "2", "-1", "²", "⁻¹" after a symbol, in tenths; 10 where there is none, 0 for what is no power.
int take_power(std::string_view& text) {
  const bool raised = take(text, "^");
  const bool small = starts_with_superscript(text);
  const bool negative = small ? take(text, "\u207b") : take(text, "-");
  int digit = -1;
  if (small) {
    for (int i = 0; i < 10 && digit < 0; ++i) {
      if (take(text, kSuperscripts[i])) digit = i;
    }
    if (starts_with_superscript(text)) return 0;
  } else if (!text.empty() && is_digit(text[0])) {
    digit = text[0] - '0';
    text.remove_prefix(1);
    if (!text.empty() && is_digit(text[0])) return 0;
  }
  if (digit < 0) return raised || negative ? 0 : 10;
  int power = 10 * digit;
  if (raised && text.size() > 1 && text[0] == '.' && is_digit(text[1])) {
    power += text[1] - '0';
    text.remove_prefix(2);
    if (!text.empty() && is_digit(text[0])) return 0;
  }
  return negative ? -power : power;
}

std::string_view take_symbol(std::string_view& text) {
  std::size_t end = 0;
  while (end < text.size()) {
    const std::string_view rest = text.substr(end);
    const bool dot = rest.starts_with("\u00b7") || rest.starts_with("\u22c5");
    if (!is_letter(rest[0]) && (static_cast<unsigned char>(rest[0]) < 0x80 || dot || starts_with_superscript(rest)))
      break;
    end += std::max<std::size_t>(utf8_length(text, end), 1);
  }
  const std::string_view symbol = text.substr(0, end);
  text.remove_prefix(end);
  return symbol;
}

const Symbol* symbol_named(std::string_view name) {
  const auto* const found =
      std::find_if(kSymbols.begin(), kSymbols.end(), [&](const Symbol& one) { return one.name == name; });
  return found == kSymbols.end() ? nullptr : &*found;
}

// A symbol with its prefix.
std::optional<Unit> unit_of_symbol(std::string_view name) {
  const Symbol* symbol = symbol_named(name);
  int prefix = 0;
  for (const Prefix& one : kPrefixes) {
    if (symbol) break;
    if (!name.starts_with(one.name)) continue;
    const Symbol* rest = symbol_named(name.substr(one.name.size()));
    if (rest && rest->takes_prefix) symbol = rest, prefix = one.exponent;
  }
  if (!symbol) return {};
  Unit unit{{},
            {std::string(symbol->to_si), symbol->to_exponent + prefix},
            {std::string(symbol->from_si), symbol->from_exponent - prefix}};
  for (std::size_t i = 0; i < unit.powers.size(); ++i) unit.powers[i] = 10 * symbol->powers[i];
  return unit;
}

// Multiplies by another unit to a power in tenths. False for powers without a decimal factor: mm^1.5.
bool multiply(Unit& unit, const Unit& by, int tenths) {
  const bool is_si = by.to_si.digits == "1" && by.to_si.exponent == 0;
  if (tenths % 10 != 0 && !is_si) return false;
  for (std::size_t i = 0; i < unit.powers.size(); ++i) unit.powers[i] += tenths * by.powers[i] / 10;
  for (int i = 0; !is_si && i < std::abs(tenths / 10); ++i) {
    unit.to_si = product(unit.to_si, tenths > 0 ? by.to_si : by.from_si);
    unit.from_si = product(unit.from_si, tenths > 0 ? by.from_si : by.to_si);
  }
  return true;
}

std::string_view without_blanks(std::string_view text) {
  while (take(text, " ") || take(text, "\u00a0") || take(text, "\u202f")) {
  }
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

constexpr std::size_t kLongestNumber = 80;  // of a number with its unit [bytes]

}  // namespace

std::optional<Unit> unit_named(std::string_view text) {
  Unit unit;
  text = without_blanks(text);
  if (text == "1") return unit;
  if (text.size() > kLongestNumber) return {};
  bool divides = take(text, "1/") || take(text, "/"), has_divided = false;
  for (;;) {
    text = without_blanks(text);
    const std::optional<Unit> one = unit_of_symbol(take_symbol(text));
    const int power = one ? take_power(text) : 0;
    // "N m/rad s" is ambiguous.
    if (power == 0 || (has_divided && !divides) || !multiply(unit, *one, divides ? -power : power)) return {};
    has_divided = has_divided || divides;
    const std::size_t before = text.size();
    text = without_blanks(text);
    if (text.empty()) return unit;
    const bool apart = text.size() < before;
    divides = take(text, "/");
    const bool times = !divides && (take(text, "*") || take(text, "\u00b7") || take(text, "\u22c5"));
    if (!divides && !times && !apart) return {};
  }
}

std::optional<NumberAndUnit> number_and_unit(std::string_view text) {
  if (text.size() > kLongestNumber) return {};
  text = without_blanks(text);
  std::size_t end = 0, digits = 0;
  if (!text.empty() && (text[0] == '+' || text[0] == '-')) ++end;
  const std::size_t begin = end;
  while (end < text.size() && (is_digit(text[end]) || text[end] == '.')) digits += is_digit(text[end++]);
  if (digits == 0 || std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '.') > 1) return {};
  const bool octal = end > begin + 1 && text[begin] == '0' && is_digit(text[begin + 1]);
  if (octal) return {};
  if (end < text.size() && (text[end] == 'e' || text[end] == 'E')) {
    std::size_t power = end + 1;
    if (power < text.size() && (text[power] == '+' || text[power] == '-')) ++power;
    if (power < text.size() && is_digit(text[power])) {
      while (power < text.size() && is_digit(text[power])) ++power;
      end = power;
    }
  }
  const std::string_view unit = without_blanks(text.substr(end));
  if (unit.empty()) return {};
  const bool looks_like_one = is_letter(unit[0]) || static_cast<unsigned char>(unit[0]) >= 0x80 || unit[0] == '/' ||
                              unit[0] == '%' || (unit.starts_with("1/") && text[end] == ' ');
  const bool based = text.substr(begin, end - begin) == "0" && unit.size() > 1 &&
                     std::string_view("xXob").find(unit[0]) != std::string_view::npos &&
                     end + unit.size() == text.size();
  if (!looks_like_one || based) return {};
  return NumberAndUnit{text.substr(0, end), unit};
}

double in_si(const NumberAndUnit& value, const Unit& unit) { return scaled(value.number, unit.to_si); }

std::vector<std::string_view> units_of_place(std::string_view stated) {
  std::vector<std::string_view> units;
  while (!stated.empty()) {
    std::size_t end = stated.size(), next = stated.size();
    for (const std::string_view between : {", or ", " or ", "; ", ", "}) {
      const std::size_t at = stated.find(between);
      if (at < end) end = at, next = at + between.size();
    }
    std::string_view unit = stated.substr(0, end);
    stated.remove_prefix(next);
    // "for computed_torque 1/s^2", "rad/m for a prismatic joint".
    if (take(unit, "for ")) unit.remove_prefix(std::min(unit.find(' ') + 1, unit.size()));
    unit = unit.substr(0, unit.find(" for "));
    if (!unit.empty()) units.push_back(unit);
  }
  return units;
}

// ---- Messages ----

namespace {

struct Named {
  std::string_view name, units;
};
// Named quantities and their units.
constexpr std::array kNamed{
    Named{"an angle", "rad, deg, mrad"},
    Named{"a length", "m, mm, cm, km"},
    Named{"a mass", "kg, g, t"},
    Named{"a time", "s, ms, min, h"},
    Named{"an angular rate", "rad/s, deg/s, rpm"},
    Named{"a speed", "m/s, mm/s, cm/s"},
    Named{"an acceleration", "m/s^2, mm/s^2"},
    Named{"a frequency", "Hz, kHz, 1/s"},
    Named{"a force", "N, mN, kN"},
    Named{"a torque", "N m, mN m, kN m"},
    Named{"an impulse", "N s, kg m/s"},
    Named{"an angular impulse", "N m s, kg m^2/s"},
    Named{"an inertia", "kg m^2, g cm^2"},
    Named{"a stiffness", "N/m, N/mm, kN/m"},
    Named{"a modulus", "Pa, MPa, GPa"},
    Named{"a density", "kg/m^3, g/cm^3, t/m^3"},
    Named{"a damping", "N s/m, kN s/m"},
    Named{"a torsional stiffness", "N m/rad, N m/deg"},
    Named{"a torsional damping", "N m s/rad, N m s/deg"},
};

const Named* named(const Unit& unit) {
  for (const Named& one : kNamed) {
    if (unit_named(one.units.substr(0, one.units.find(',')))->has_dimension_of(unit)) return &one;
  }
  return nullptr;
}

// "an angle [rad, deg, mrad] or a length [m, mm, cm, km]".
std::string expected_at(std::span<const std::string_view> units) {
  std::string text;
  for (std::size_t i = 0; i < units.size(); ++i) {
    if (units[i] == "1" && units.size() > 1) continue;
    text += (text.empty() ? "" : i + 1 == units.size() ? " or " : ", ") + expected_of(units[i]);
  }
  return text;
}

// "; did you mean 'kg'?" for an unknown unit.
std::string meant_unit(std::string_view unit, std::span<const std::string_view> units) {
  for (const Alias& alias : kAliases) {
    if (unit == alias.written) return fmt::format("; did you mean '{}'?", alias.meant);
  }
  std::vector<std::string> candidates;
  for (const std::string_view one : units) {
    const std::optional<Unit> of_place = unit_named(one);
    const Named* const name = of_place ? named(*of_place) : nullptr;
    for (const std::string_view known : units_of_place(name ? name->units : one)) candidates.emplace_back(known);
  }
  const std::string near = nearest(unit, candidates);
  return near.empty() ? "; expected " + expected_at(units) : "; did you mean " + in_quotes(near) + "?";
}

}  // namespace

std::string expected_of(std::string_view unit) {
  const std::optional<Unit> meaning = unit_named(unit);
  if (meaning && meaning->is_dimensionless()) return "a number without unit";
  const Named* const name = meaning ? named(*meaning) : nullptr;
  return name ? fmt::format("{} [{}]", name->name, name->units) : fmt::format("a number [{}]", unit);
}

UnitReading take_unit(Node& node, std::string_view stated, const std::string& name, FaultList& faults) {
  if (node.unit == Node::kRefusedUnit) return UnitReading::refused;
  if (!node.is_scalar()) return UnitReading::none;
  const auto parts = number_and_unit(node.text);
  if (!parts) return UnitReading::none;
  const auto refuse = [&](const std::string& message) {
    faults.add(node.mark, message);
    node.unit = Node::kRefusedUnit;
    return UnitReading::refused;
  };
  const std::vector<std::string_view> units = units_of_place(stated);
  const bool has_none = std::all_of(units.begin(), units.end(), [](std::string_view unit) { return unit == "1"; });
  const std::optional<Unit> given = unit_named(parts->unit);
  if (!given && !number_advice(node.text).empty()) return UnitReading::none;  // another kind of error
  if (has_none) {
    const bool is_percentage = parts->unit == "%";
    return refuse(fmt::format("{} must be a number without unit, not {}{}", name, in_quotes(node.text),
                              is_percentage ? fmt::format("; write {}", scaled(parts->number, {"1", -2})) : ""));
  }
  if (!given)
    return refuse(fmt::format("{}: unknown unit {} in {}{}", name, in_quotes(parts->unit), in_quotes(node.text),
                              meant_unit(parts->unit, units)));
  for (std::size_t i = 0; i < units.size(); ++i) {
    const std::optional<Unit> wanted = unit_named(units[i]);
    if (!wanted || !wanted->has_dimension_of(*given)) continue;
    const double value = scaled(parts->number, product(given->to_si, wanted->from_si));
    if (!std::isfinite(value))
      return refuse(fmt::format("{} is {}, which is outside the range of a double", name, in_quotes(node.text)));
    node.written =
        std::exchange(node.text, fmt::format("{}", value));  // the shortest that reads back to the same double
    node.plain = true;
    node.unit = static_cast<std::uint8_t>(i + 1);
    return UnitReading::taken;
  }
  const Named* const found = given->is_dimensionless() ? nullptr : named(*given);
  return refuse(fmt::format("{} is {}{}; expected {}", name, in_quotes(node.text),
                            found ? fmt::format(", {}", found->name) : "", expected_at(units)));
}

const std::string& number_with_unit_pattern() {
  static const std::string kPattern = [] {
    std::string prefixed, alone, prefixes;
    for (const Symbol& symbol : kSymbols) {
      std::string& list = symbol.takes_prefix ? prefixed : alone;
      list += (list.empty() ? "" : "|") + std::string(symbol.name);
    }
    for (const Prefix& prefix : kPrefixes) prefixes += (prefixes.empty() ? "" : "|") + std::string(prefix.name);
    const std::string unit = fmt::format(
        "(({})?({})|{})(\\^?-?[0-9]([.][0-9])?|\u00b2|\u00b3|\u207b\u00b9|\u207b\u00b2)?", prefixes, prefixed, alone);
    return fmt::format("^[-+]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][-+]?[0-9]+)? *(1?/ *)?{}(( *([*/]|\u00b7) *| +){})*$",
                       unit, unit);
  }();
  return kPattern;
}

}  // namespace grapnel
