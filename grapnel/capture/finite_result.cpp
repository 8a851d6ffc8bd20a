#include "grapnel/capture/finite_result.hpp"

#include <cmath>
#include <optional>

#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

// The path from a value to its first non-finite number: "" if it is the number itself.
using Path = std::optional<std::string>;

Path path_in(const Type& type, const void* value, bool also_unknown);

// By its name or names if it has any: "[left]", "[left, right]".
std::string place_of(const Type& type, const void* item, std::size_t i) {
  if (type.fields.empty()) return "[" + std::to_string(i) + "]";
  const Type& first = type.fields[0].type();
  std::string name;
  const auto add_text = [&](const void* text) {
    name += (name.empty() ? "" : ", ") + *static_cast<const std::string*>(text);
  };
  const auto add_texts = [&](const void* texts) {
    for (std::size_t k = 0; k < first.size(texts); ++k) first.show_item(texts, k, visitor_of(add_text));
  };
  if (first.kind == Type::Kind::text) type.fields[0].show(item, visitor_of(add_text));
  if (first.kind == Type::Kind::list && first.of().kind == Type::Kind::text)
    type.fields[0].show(item, visitor_of(add_texts));
  return "[" + (name.empty() ? std::to_string(i) : name) + "]";
}

// List and its type => path of its first number that is not finite. Of lists of three numbers the sum of squares must
// be finite, too, since norms are computed from it.
Path path_in_list(const Type& type, const void* list, bool also_unknown) {
  const Type& of = type.of();
  Path found;
  double squares = 0;
  for (std::size_t i = 0; i < type.size(list) && !found; ++i) {
    const auto inspect = [&](const void* item) {
      if (of.kind == Type::Kind::real) {
        const double x = *static_cast<const double*>(item);
        squares += x * x;
        if (type.fixed_size != 3 && !std::isfinite(x)) found = "";
      } else if (const Path below = path_in(of, item, also_unknown)) {
        found = place_of(of, item, i) + *below;
      }
    };
    type.show_item(list, i, visitor_of(inspect));
  }
  return !found && type.fixed_size == 3 && !std::isfinite(squares) ? Path("") : found;
}

// Structure and its type => path of its first number that is not finite; derived fields, absent values and, unless
// `also_unknown`, fields whose null value means absent are skipped.
Path path_in_structure(const Type& type, const void* owner, bool also_unknown) {
  Path found;
  for (const Field& field : type.fields) {
    // derived fields follow from the others
    if (!field.place || (field.is_present && !field.is_present(owner))) continue;
    if (field.is_null_absent && !also_unknown) continue;
    const auto inspect = [&](const void* value) {
      if (const Path below = path_in(field.type(), value, also_unknown)) found = "." + std::string(field.key) + *below;
    };
    field.show(owner, visitor_of(inspect));
    if (found) break;
  }
  return found;
}

// Value and its type => path of its first number that is not finite: "" for the number itself, empty if all are finite
// or the type has none.
Path path_in(const Type& type, const void* value, bool also_unknown) {
  switch (type.kind) {
    case Type::Kind::real:
      return std::isfinite(*static_cast<const double*>(value)) ? Path() : Path("");
    case Type::Kind::list:
      return path_in_list(type, value, also_unknown);
    case Type::Kind::structure:
      return path_in_structure(type, value, also_unknown);
    case Type::Kind::optional: {
      Path found;
      const auto inspect = [&](const void* item) { found = path_in(type.of(), item, also_unknown); };
      if (type.size(value) == 1) type.show_item(value, 0, visitor_of(inspect));
      return found;
    }
    default:
      return {};
  }
}

// Keeps the first.
class Finder {
 public:
  template <class T>
  void check(const std::string& key, const T& value, bool also_unknown = false) {
    if (!found_.empty()) return;
    if (const Path path = path_in(type_of<T>(), &value, also_unknown)) found_ = key + *path;
  }
  const std::string& found() const { return found_; }

 private:
  std::string found_;
};

}  // namespace

// Result => path of its first number that is not finite, for the failure message; empty if all checked parts are
// finite.
std::string first_not_finite(const CaptureResult& result) {
  Finder finder;
  finder.check("approach.start", result.approach_start);
  finder.check("approach.end", result.approach_end);
  finder.check("capture.grasps", result.grasps, true);  // in a run that reached its end, all values are known
  if (result.impact()) finder.check("impact", *result.impact());
  finder.check("later_impacts", result.later_impacts());
  finder.check("phases", result.phases);
  finder.check("post_impact.end", result.post_impact_end);
  finder.check("post_impact.grasp_loads", result.grasp_loads);
  for (const LawReport& law : result.laws)
    finder.check(std::string(law.in_approach ? "approach." : "post_impact.") + name_of(law.law), law);
  for (const WheelReport& wheel : result.wheels) finder.check("wheels.rate_after", wheel.rate_after);
  if (result.gyros) finder.check("gyros.least_singularity_measure", result.gyros->least_singularity_measure);
  finder.check("joints", result.joints);
  finder.check("stop_impacts", result.stop_impacts);
  finder.check("contacts", result.contacts);
  if (result.thrusters) finder.check("thrusters.propellant", result.thrusters->propellant);
  finder.check("ledger.scale", result.ledger.scale);
  return finder.found();
}

}  // namespace grapnel
