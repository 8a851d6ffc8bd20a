#include "grapnel/campaign/criterion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace grapnel {
namespace criterion_test {

const std::vector<std::string> kNames{
    "captured",              // 0
    "grasps/tip-1/impulse",  // 1
    "grasps/tip-2/impulse",  // 2
    "grasps/tip-1/rating",   // 3
    "grasps/tip-2/rating",   // 4
    "a",                     // 5
    "b",                     // 6
    "a/b",                   // 7
    "targets.t-1.mass",      // 8
    "spin/x",                // 9
    "a b (c)",               // 10
    "max",                   // 11
    "margins/arm/load",      // 12
    "2nd/x",                 // 13
};
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<double> numbers() { return {1, 0.4, 0.6, 0.5, 0.7, 8, 2, 100, 10, -0.25, 7, 3, 0.1, 55}; }

bool holds(const std::string& text, const std::vector<double>& row = numbers()) {
  return Criterion::parse(text, kNames).holds(row);
}

struct Fault {
  std::string message;
  std::size_t offset = 0;
};
Fault fault_of(const std::string& text) {
  try {
    Criterion::parse(text, kNames);
  } catch (const CriterionError& error) {
    return {error.what(), error.offset};
  }
  return {"no fault", 999999};
}

TEST(Criterion, SupportsAllComparisons) {
  for (const auto& [text, value] : std::vector<std::pair<std::string, bool>>{{"a < 9", true},
                                                                             {"a < 8", false},
                                                                             {"a <= 8", true},
                                                                             {"a <= 7.9", false},
                                                                             {"a > 7", true},
                                                                             {"a > 8", false},
                                                                             {"a >= 8", true},
                                                                             {"a >= 8.1", false},
                                                                             {"a == 8", true},
                                                                             {"a == 7", false},
                                                                             {"a != 7", true},
                                                                             {"a != 8", false},
                                                                             {"captured", true},
                                                                             {"not captured", false},
                                                                             {"captured and a < 9", true},
                                                                             {"captured and a < 1", false},
                                                                             {"a < 1 or b == 2", true},
                                                                             {"a < 1 or b == 3", false},
                                                                             {"a<9and b<3", true},
                                                                             {"(a<9)and(b<3)", true},
                                                                             {"1e1 > a", true},
                                                                             {".5 < b", true},
                                                                             {"5. < a", true}}) {
    EXPECT_EQ(holds(text), value) << text;
  }
}

TEST(Criterion, BindsAsArithmeticAndLogicDo) {
  EXPECT_TRUE(holds("1 + 2 * 3 == 7"));
  EXPECT_TRUE(holds("(1 + 2) * 3 == 9"));
  EXPECT_TRUE(holds("10 - 3 - 2 == 5"));
  EXPECT_TRUE(holds("24 / 4 / 3 == 2"));
  EXPECT_TRUE(holds("24 / 4 * 3 == 18"));
  EXPECT_TRUE(holds("-2 * -3 == 6"));
  EXPECT_TRUE(holds("2 - -3 == 5"));
  EXPECT_TRUE(holds("- - 2 == +2"));
}

TEST(Criterion, KnowsPrecedenceOfLogic) {
  EXPECT_TRUE(holds("1 or 0 and 0"));
  EXPECT_FALSE(holds("(1 or 0) and 0"));
  EXPECT_TRUE(holds("not 0 and 1"));
  EXPECT_FALSE(holds("not (0 or 1)"));
  EXPECT_TRUE(holds("not a < 1"));
  EXPECT_TRUE(holds("not not captured"));
  EXPECT_TRUE(holds("(a < 9) + (b < 3) + (a < 1) == 2")) << "conditions are 1 and 0";
}

TEST(Criterion, HasFunctions) {
  EXPECT_TRUE(holds("abs(spin/x) == 0.25"));
  EXPECT_TRUE(holds("sqrt(a + 1) == 3"));
  EXPECT_TRUE(holds("min(a, b, 5) == 2"));
  EXPECT_TRUE(holds("max(a, b, 5) == 8"));
  EXPECT_TRUE(holds("max (grasps/*/impulse) == 0.6"));
  EXPECT_TRUE(holds("min(grasps/*/rating - grasps/*/impulse) > 0.09"));
  EXPECT_TRUE(holds("max(max(a, 3), min(b, 1)) == 8"));
  EXPECT_TRUE(holds("max == 3")) << "a column's name, as nothing is called";
  EXPECT_TRUE(holds("max(max, 1) == 3"));
}

TEST(Criterion, TakesTheLongestName) {
  EXPECT_TRUE(holds("a/b == 100")) << "the column a/b";
  EXPECT_TRUE(holds("a / b == 4")) << "a divided by b";
  EXPECT_TRUE(holds("a /b == 4"));
  EXPECT_TRUE(holds("a-b == 6"));
  EXPECT_TRUE(holds("a/2 == 4")) << "no column is called so";
  EXPECT_TRUE(holds("a-2 == 6"));
  EXPECT_TRUE(holds("b-1e-1 > 1.8"));
  EXPECT_TRUE(holds("targets.t-1.mass-1 == 9"));
  EXPECT_TRUE(holds("a*b == 16"));
  EXPECT_TRUE(holds("`a b (c)` == 7"));
  EXPECT_TRUE(holds("`a`/`b` == 4"));
  EXPECT_TRUE(holds("2nd/x == 55")) << "a name that begins with a number";
  EXPECT_TRUE(holds("2/a == 0.25"));
}

TEST(Criterion, TakesAllNamesThatMatch) {
  EXPECT_TRUE(holds("grasps/*/impulse < 0.7"));
  EXPECT_FALSE(holds("grasps/*/impulse < 0.5"));
  EXPECT_TRUE(holds("grasps/*/impulse < grasps/*/rating")) << "each with its own";
  EXPECT_FALSE(holds("grasps/*/impulse < grasps/tip-1/rating"));
  EXPECT_TRUE(holds("max(grasps/*/impulse) > min(grasps/*/rating)"));
  EXPECT_TRUE(holds("2 * abs(grasps/*/impulse) < 1.3"));
  EXPECT_TRUE(holds("grasps/*/impulse"));
  EXPECT_FALSE(holds("not grasps/*/impulse < 0.7"));
  EXPECT_TRUE(holds("*/*/load == 0.1"));
  EXPECT_EQ(Criterion::parse("grasps/*/impulse < b", kNames).reads(), (std::vector<std::size_t>{1, 2, 6}));
  std::vector<double> row = numbers();
  row[2] = 0;
  EXPECT_FALSE(holds("grasps/*/impulse", row)) << "all must be true";
}

TEST(Criterion, NothingComparesWithNaN) {
  std::vector<double> row = numbers();
  row[5] = kNaN;
  for (const char* text : {"a < 1",          "a <= 1",         "a > 1",
                           "a >= 1",         "a == 1",         "a != 1",
                           "a == a",         "a != a",         "a",
                           "-a < 1",         "a + 1 > 0",      "a * 0 == 0",
                           "abs(a) >= 0",    "sqrt(a) >= 0",   "min(a, 1) <= 1",
                           "min(1, a) <= 1", "max(a, 1) >= 1", "max(1, a) >= 1",
                           "sqrt(-1) >= 0",  "0 / 0 == 0"})
    EXPECT_FALSE(holds(text, row)) << text;
  // Unknown: the negation does not hold either.
  EXPECT_FALSE(holds("not a < 1", row));
  EXPECT_FALSE(holds("not a", row));
  EXPECT_FALSE(holds("not (a < 1 and captured)", row));
  EXPECT_FALSE(holds("not (a < 1 or 1 > 2)", row));
  EXPECT_TRUE(holds("not (a < 1 and 1 > 2)", row));
  EXPECT_TRUE(holds("a < 1 or captured", row));
  EXPECT_TRUE(holds("1 / 0 > 1e300")) << "infinity is a number";
}

TEST(Criterion, ReportsLimitsOnSingleNumbers) {
  const auto limits = [](const std::string& text) {
    std::string all;
    const Criterion criterion = Criterion::parse(text, kNames);
    for (const CriterionLimit& l : criterion.limits())
      all += kNames[l.number] + (l.at_most ? "<" : ">") + std::to_string(l.bound).substr(0, 4) +
             (l.magnitude ? "|" : "") + " ";
    return all;
  };
  EXPECT_EQ(limits("a < 0.5"), "a<0.50 ");
  EXPECT_EQ(limits("0.5 <= a"), "a>0.50 ");
  EXPECT_EQ(limits("abs(spin/x) <= 2 * 3"), "spin/x<6.00| ");
  EXPECT_EQ(limits("captured and (a > 1 and b < 2)"), "a>1.00 b<2.00 ");
  EXPECT_EQ(limits("grasps/*/impulse < 1"), "grasps/tip-1/impulse<1.00 grasps/tip-2/impulse<1.00 ");
  EXPECT_EQ(limits("max(a, abs(b)) < 1"), "a<1.00 b<1.00| ");
  EXPECT_EQ(limits("min(a, b) > 1"), "a>1.00 b>1.00 ");
  for (const char* none :
       {"max(a, b) > 1", "a < 1 or b < 1", "not a < 1", "a < b", "a + b < 1", "a == 1", "captured", "1 < 2"})
    EXPECT_EQ(limits(none), "") << none;
}

TEST(Criterion, ReportsErrorsWithPositions) {
  const auto expect = [](const std::string& text, std::size_t offset, const std::string& part) {
    const Fault fault = fault_of(text);
    EXPECT_EQ(fault.offset, offset) << text << ": " << fault.message;
    EXPECT_NE(fault.message.find(part), std::string::npos) << text << ": " << fault.message;
  };
  expect("", 0, "missing");
  expect("   ", 0, "missing");
  expect("captred and a < 1", 0, "unknown number 'captred'; did you mean 'captured'?");
  expect("a < 1 and impulse < 2", 10, "did you mean 'grasps/tip-1/impulse'?");
  expect("a < 1 and captred-1 > 0", 10, "did you mean 'captured'?");
  expect("a < grasps/tip-1/impuls", 4, "did you mean 'grasps/tip-1/impulse'?");
  expect("a < `spin/z`", 5, "did you mean 'spin/x'?");
  expect("a < `b", 4, "does not end");
  expect("grasps/*/torque < 1", 0, "no name matches 'grasps/*/torque'");
  expect("a < grasps/*/impulse + */*/load", 23, "do not match the same");
  expect("a < 1 < b", 6, "not chained");
  expect("a = 1", 2, "did you mean '=='?");
  expect("a && b", 2, "did you mean 'and'?");
  expect("a || b", 2, "did you mean 'or'?");
  expect("!a", 0, "did you mean 'not'?");
  expect("a <> 1", 2, "did you mean '!='?");
  expect("a ≤ 1", 2, "did you mean '<='?");
  expect("a ^ 2", 2, "no operator '^'");
  expect("a ** 2", 2, "no operator '**'");
  expect("(a < 1", 0, "not closed");
  expect("a < 1)", 5, "no '(' is open");
  expect("max(a, b", 3, "not closed");
  expect("a <", 3, "found the end");
  expect("a < < b", 4, "found '<'");
  expect("and a", 0, "before 'and'");
  expect("a < 0.5 kgs", 8, "units are written as in '0.2 N s'");
  expect("a b", 2, "expected an operator");
  expect("a, b", 1, "separates the arguments");
  expect("abs(a, b) < 1", 5, "takes one argument");
  expect("sin(a) < 1", 0, "functions are abs, sqrt, min, max");
  expect("max() < 1", 4, "expected a number or a name");
  expect("a < 1e999", 4, "too large");
  expect("status == 0", 0, "not a number of a case");
  expect("a < \x01", 4, "control character");
  expect("a < $", 4, "found '$'");
  expect("a < é", 4, "'é'");
}

TEST(Criterion, NumbersMayHaveUnits) {
  // In the order of kNames; "" is not known.
  std::vector<std::string> units(kNames.size(), "1");
  units[1] = units[2] = "N s", units[3] = "N", units[5] = "m", units[9] = "rad/s", units[12] = "deg", units[13] = "";
  const auto parsed = [&](const std::string& text) { return Criterion::parse(text, kNames, "", units); };
  const auto holds_for = [&](const std::string& text) { return parsed(text).holds(numbers()); };
  EXPECT_TRUE(holds_for("grasps/tip-1/impulse < 401 mN s"));  // it is 0.4 N s
  EXPECT_FALSE(holds_for("grasps/tip-1/impulse < 399 mN s"));
  EXPECT_TRUE(holds_for("grasps/*/impulse < 0.61 kg m/s and captured"));
  EXPECT_TRUE(holds_for("abs(spin/x) < 0.2501 rad/s"));
  EXPECT_TRUE(holds_for("abs(spin/x) < 14.33 deg/s"));  // 0.25 rad/s are 14.32 deg/s
  EXPECT_FALSE(holds_for("abs(spin/x) < 14.32deg/s"));
  EXPECT_TRUE(holds_for("a > 7.9 m or captured"));
  EXPECT_TRUE(holds_for("a - 2 * 4 m == 0"));
  EXPECT_TRUE(holds_for("grasps/tip-1/impulse / 0.1 s > 3.99 N"));
  EXPECT_TRUE(holds_for("sqrt(a * a) < 801 cm"));
  EXPECT_TRUE(holds_for("max(a, 3 m) == 8 m"));
  EXPECT_TRUE(holds_for("2nd/x < 56 N s"));  // with an unknown unit
  EXPECT_EQ(parsed("grasps/tip-1/impulse < 200 mN s").limits().at(0).bound, 0.2);
  // Without units of the names nothing is compared, and numbers become SI all the same.
  EXPECT_EQ(Criterion::parse("a < 250 mm", kNames).limits().at(0).bound, 0.25);

  const auto expect = [&](const std::string& text, std::size_t offset, const std::string& message) {
    try {
      parsed(text);
      FAIL() << text;
    } catch (const CriterionError& error) {
      EXPECT_EQ(error.what(), message) << text;
      EXPECT_EQ(error.offset, offset) << text;
    }
  };
  expect("grasps/tip-1/impulse < 0.2 N", 23, "a number in 'N' cannot be compared with 'grasps/tip-1/impulse' (in N s)");
  expect("a + 0.1 s < 5", 4, "a number in 's' cannot be added to 'a' (in m)");
  expect("captured and targets.t-1.mass < 2 deg", 32,
         "a number in 'deg' cannot be compared with 'targets.t-1.mass' (a number without unit)");
  expect("a * a < 2 m", 8, "a number in 'm' cannot be compared with a product or quotient");
  expect("*/*/impulse + 1 N s < max(1 N s, 2 m)", 33, "a number in 'm' cannot be put beside a number in 'N s'");
  expect("margins/arm/load < 0.1 rad", 19,
         "'margins/arm/load' (in deg) takes numbers in its unit, which is not written");
}

TEST(Criterion, SurvivesHostileTexts) {
  const auto repeated = [](const std::string& text, int count) {
    std::string all;
    for (int i = 0; i < count; ++i) all += text;
    return all;
  };
  EXPECT_NE(fault_of(repeated("(", 9000)).message.find("nested"), std::string::npos);
  EXPECT_NE(fault_of(repeated("-", 9000) + "1").message.find("nested"), std::string::npos);
  EXPECT_NE(fault_of(repeated("not ", 2000) + "1").message.find("nested"), std::string::npos);
  EXPECT_NE(fault_of(repeated("abs(", 2000)).message.find("nested"), std::string::npos);
  EXPECT_NE(fault_of(repeated("a", 1000000)).message.find("at most 10000"), std::string::npos);
  EXPECT_TRUE(holds(repeated("a+", 4990) + "a > 39927"));
  EXPECT_TRUE(holds(repeated("1 and ", 1600) + "1"));
  EXPECT_TRUE(holds(repeated("(", 99) + "a" + repeated(")", 99)));
  EXPECT_NE(fault_of(repeated("a/", 4990) + "a").message, "") << "divisions without end";
  EXPECT_NE(fault_of(repeated("*/", 4990)).message, "no fault");
  EXPECT_NE(fault_of(std::string("a < 1\0 and b", 12)).message, "no fault");
}

// Whatever the text, there is an expression or a message with a place in the text.
TEST(Criterion, AnyTextIsReadOrRefused) {
  const std::vector<std::string> pieces{"a",        "b",    "a/b",  "grasps/*/impulse",
                                        "captured", "(",    ")",    "and ",
                                        "or ",      "not ", "<",    "<=",
                                        "==",       "!=",   "+",    "-",
                                        "*",        "/",    "abs(", "max(",
                                        ",",        "1",    "2.5",  "`",
                                        " ",        "1e5",  ".",    "é",
                                        "x",        "=",    "min(", "spin/x"};
  std::mt19937 random(1);
  int read = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text;
    for (auto n = random() % 12; n > 0; --n) text += pieces[random() % pieces.size()];
    try {
      const Criterion criterion = Criterion::parse(text, kNames);
      criterion.holds(numbers());
      for (const std::size_t index : criterion.reads()) EXPECT_LT(index, kNames.size());
      ++read;
    } catch (const CriterionError& error) {
      EXPECT_LE(error.offset, text.size()) << text;
      EXPECT_NE(std::string(error.what()), "") << text;
    }
  }
  EXPECT_GT(read, 500);  // measured 1100
}

// Random expressions against the same arithmetic done beside.
struct Grown {
  std::string text;
  double value = 0;
  int level = 0;  // 0 or, 1 and, 2 not, 3 comparison, 4 sum, 5 product, 6 operand
};

class Grower {
 public:
  explicit Grower(unsigned seed) : random_(seed) {}
  Grown condition(int depth) {
    switch (depth == 0 ? 3 : random_() % 4) {
      case 0:
        return join(condition(depth - 1), "or", condition(depth - 1), 0);
      case 1:
        return join(condition(depth - 1), "and", condition(depth - 1), 1);
      case 2: {
        const Grown part = wrapped(condition(depth - 1), 2);
        return {"not " + part.text, 1 - part.value, 2};
      }
      default:
        return compare(number(depth), number(depth));
    }
  }

 private:
  Grown number(int depth) {
    static const std::vector<double> row = numbers();
    switch (depth == 0 ? random_() % 2 : random_() % 7) {
      case 0: {
        const std::size_t i = std::vector<std::size_t>{0, 1, 5, 6, 7, 8, 9, 12}[random_() % 8];
        return {kNames[i], row[i], 6};
      }
      case 1: {
        const int value = static_cast<int>(random_() % 5);
        return {std::to_string(value), static_cast<double>(value), 6};
      }
      case 2:
        return arithmetic(number(depth - 1), '+', number(depth - 1), 4);
      case 3:
        return arithmetic(number(depth - 1), '-', number(depth - 1), 4);
      case 4:
        return arithmetic(number(depth - 1), '*', number(depth - 1), 5);
      case 5:
        return arithmetic(number(depth - 1), '/', number(depth - 1), 5);
      default: {
        const Grown a = number(depth - 1), b = number(depth - 1);
        const bool is_nan = std::isnan(a.value) || std::isnan(b.value);
        return {"max(" + a.text + ", " + b.text + ")", is_nan ? kNaN : std::max(a.value, b.value), 6};
      }
    }
  }
  static Grown wrapped(const Grown& part, int level) {
    return part.level >= level ? part : Grown{"(" + part.text + ")", part.value, 6};
  }
  static Grown join(const Grown& a, const std::string& word, const Grown& b, int level) {
    const Grown x = wrapped(a, level), y = wrapped(b, level + 1);
    // Undecided where the other alone does not decide.
    const double decides = word == "and" ? 0 : 1;
    const bool decided = x.value == decides || y.value == decides;
    const double rest = std::isnan(x.value) || std::isnan(y.value) ? kNaN : 1 - decides;
    return {x.text + " " + word + " " + y.text, decided ? decides : rest, level};
  }
  Grown compare(const Grown& a, const Grown& b) {
    const Grown x = wrapped(a, 4), y = wrapped(b, 4);
    const bool ordered = !std::isnan(x.value) && !std::isnan(y.value);
    const auto value = [&](bool holds) { return !ordered ? kNaN : holds ? 1.0 : 0.0; };
    switch (random_() % 3) {
      case 0:
        return {x.text + " < " + y.text, value(x.value < y.value), 3};
      case 1:
        return {x.text + " >= " + y.text, value(x.value >= y.value), 3};
      default:
        return {x.text + " != " + y.text, value(x.value != y.value), 3};
    }
  }
  static Grown arithmetic(const Grown& a, char sign, const Grown& b, int level) {
    const Grown x = wrapped(a, level), y = wrapped(b, level + 1);
    const double value = sign == '+'   ? x.value + y.value
                         : sign == '-' ? x.value - y.value
                         : sign == '*' ? x.value * y.value
                                       : x.value / y.value;
    return {x.text + " " + sign + " " + y.text, value, level};
  }
  std::mt19937 random_;
};

TEST(Criterion, EvaluatesExpressions) {
  int true_ones = 0;
  for (unsigned seed = 0; seed < 3000; ++seed) {
    const Grown grown = Grower(seed).condition(4);
    if (grown.text.size() > Criterion::kLongest) continue;
    ASSERT_EQ(holds(grown.text), grown.value == 1) << grown.text;
    true_ones += grown.value == 1;
  }
  EXPECT_GT(true_ones, 800);
  EXPECT_LT(true_ones, 2200);
}

TEST(Criterion, HasAName) {
  EXPECT_EQ(Criterion::parse("a < 1", kNames).name(), "a < 1");
  EXPECT_EQ(Criterion::parse("a < 1", kNames, "slow").name(), "slow");
  EXPECT_EQ(Criterion::parse("a < 1", kNames, "slow").text(), "a < 1");
}

TEST(Criterion, ReportsUncheckedConditions) {
  std::vector<double> row = numbers();
  row[5] = kNaN;
  const auto judged = [&](const char* text) { return Criterion::parse(text, kNames).judge(row); };
  for (const char* text : {"a < 1", "not a < 1", "a", "not a", "a < 1 and captured", "a < 1 or not captured"})
    EXPECT_EQ(judged(text), Verdict::not_checked) << text;
  EXPECT_EQ(judged("a < 1 and not captured"), Verdict::no) << "whatever a is";
  EXPECT_EQ(judged("a < 1 or captured"), Verdict::yes);
}

}  // namespace criterion_test
}  // namespace grapnel
