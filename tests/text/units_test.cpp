// Numbers with units: what units mean, that numbers are rounded once, and what is refused.
#include "grapnel/text/units.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <regex>

#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace units_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Taken {
  UnitReading reading;
  double value = NAN;
  int unit = 0;
  std::string fault;
};
Taken take(const std::string& text, const std::string& stated) {
  Node node;
  node.kind = Node::Kind::scalar;
  node.text = text;
  FaultList faults;
  Taken taken{take_unit(node, stated, "it", faults), NAN, node.unit, {}};
  if (taken.reading == UnitReading::taken) taken.value = number_of(node).value_or(NAN);
  for (const Fault& fault : faults.all()) taken.fault += fault.message;
  return taken;
}

TEST(Units, AreExactInDecimals) {
  const std::tuple<const char*, const char*, double> cases[] = {
      {"250 mm", "m", 0.25},
      {"0.1 mm", "m", 1e-4},
      {"3 um", "m", 3e-6},
      {"3 \u00b5m", "m", 3e-6},
      {"3 \u03bcm", "m", 3e-6},
      {"7 km", "m", 7000},
      {"-1.5e-3 km", "m", -1.5},
      {"12cm", "m", 0.12},
      {"8.2 t", "kg", 8200},
      {"340 g", "kg", 0.34},
      {"2 Mg", "kg", 2000},
      {"1.5 min", "s", 90},
      {"0.1 h", "s", 360},
      {"20 ms", "s", 0.02},
      {"36 km/h", "m/s", 10},
      {"1.8 km/h", "m/s", 0.5},
      {"5 cm/s", "m/s", 0.05},
      {"300 kg cm^2", "kg m^2", 0.03},
      {"2 g\u00b7m\u00b2", "kg m^2", 0.002},
      {"2 kg*m2", "kg m^2", 2},
      {"4.7 mN m", "N m", 0.0047},
      {"4.7 mNm", "N m", 0.0047},
      {"3 kg m^2/s^2", "N m", 3},
      {"4 J", "N m", 4},
      {"2.5 N/mm", "N/m", 2500},
      {"1e5 N/m^1.5", "N/m^1.5", 1e5},
      {"12 N m s", "kg m^2/s", 12},
      {"9 Ns", "kg m/s", 9},
      {"2 kHz", "Hz", 2000},
      {"2 s^-1", "Hz", 2},
      {"2 1/s", "Hz", 2},
      {"9.81 m/s\u00b2", "m/s^2", 9.81},
      {"9.81 m s\u207b\u00b2", "m/s^2", 9.81},
      {"9.81 m/s/s", "m/s^2", 9.81},
      {"+.5 m", "m", 0.5},
      {"20 deg", "deg", 20},  // quantities of studies may be in degrees
  };
  for (const auto& [text, stated, value] : cases) {
    const Taken taken = take(text, stated);
    EXPECT_EQ(taken.value, value) << text << taken.fault;
    EXPECT_EQ(taken.unit, 1) << text;
    EXPECT_TRUE(std::regex_match(text, std::regex(number_with_unit_pattern()))) << text;
  }
}

// By quadruple precision, which rounds once more but only far from where it matters.
TEST(Units, AnglesAreRoundedOnce) {
  __extension__ using Wide = __float128;
  const Wide pi = Wide{3.141592653589793115997963468544185161591} + Wide{1.2246467991473531772e-16};
  for (int i = -720; i <= 720; ++i) {
    EXPECT_EQ(take(std::to_string(i) + " deg", "rad").value, static_cast<double>(i * pi / 180)) << i;
    EXPECT_EQ(take(std::to_string(i) + " rpm", "rad/s").value, static_cast<double>(i * pi / 30)) << i;
    EXPECT_EQ(take(std::to_string(i) + " rev", "rad").value, static_cast<double>(i * 2 * pi)) << i;
    EXPECT_EQ(take(std::to_string(i) + " arcsec", "rad").value, static_cast<double>(i * pi / 648000)) << i;
  }
  EXPECT_EQ(take("180 deg", "rad").value, std::numbers::pi);
  EXPECT_EQ(take("90\u00b0", "rad").value, std::numbers::pi / 2);
  EXPECT_EQ(take("1 N m/deg", "N m/rad").value, 180 / std::numbers::pi);
}

TEST(Units, ReturnTheIndexAmongSeveral) {
  EXPECT_EQ(take("90 deg", "rad or m").unit, 1);
  EXPECT_EQ(take("5 mm", "rad or m").unit, 2);
  EXPECT_EQ(take("3 1/s^2", "N m/rad or N/m; for computed_torque 1/s^2").unit, 3);
  EXPECT_EQ(take("50 rad/m", "1, or rad/m for a prismatic joint").unit, 2);
  EXPECT_THAT(units_of_place("N m/rad or N/m; for computed_torque 1/s^2"), ElementsAre("N m/rad", "N/m", "1/s^2"));
  EXPECT_THAT(units_of_place("N/m, N/m^1.5 or N/m^n"), ElementsAre("N/m", "N/m^1.5", "N/m^n"));
  EXPECT_THAT(units_of_place("1, or rad/m for a prismatic joint"), ElementsAre("1", "rad/m"));
  EXPECT_THAT(units_of_place("s, N, N m"), ElementsAre("s", "N", "N m"));
}

TEST(Units, ReportErrors) {
  const std::tuple<const char*, const char*, const char*> cases[] = {
      {"30 mm", "rad", "it is '30 mm', a length; expected an angle [rad, deg, mrad]"},
      {"30 deg", "m", "it is '30 deg', an angle; expected a length [m, mm, cm, km]"},
      {"30 deg", "s", "it is '30 deg', an angle; expected a time [s, ms, min, h]"},
      {"3 Hz", "rad/s", "it is '3 Hz', a frequency; expected an angular rate [rad/s, deg/s, rpm]"},
      {"3 N m", "N m/rad", "it is '3 N m', a torque; expected a torsional stiffness [N m/rad, N m/deg]"},
      {"3 kg/m", "kg", "it is '3 kg/m'; expected a mass [kg, g, t]"},
      {"3 kg", "rad or m", "it is '3 kg', a mass; expected an angle [rad, deg, mrad] or a length [m, mm, cm, km]"},
      {"3 kgs", "kg", "it: unknown unit 'kgs' in '3 kgs'; did you mean 'kg'?"},
      {"3 KG", "kg", "it: unknown unit 'KG' in '3 KG'; did you mean 'kg'?"},
      {"30 degrees", "rad", "it: unknown unit 'degrees' in '30 degrees'; did you mean 'deg'?"},
      {"3 furlong", "m", "it: unknown unit 'furlong' in '3 furlong'; expected a length [m, mm, cm, km]"},
      {"3 N m/rad s", "N m/rad", "it: unknown unit 'N m/rad s' in '3 N m/rad s'; did you mean 'N m/rad'?"},
      {"3 m", "", "it must be a number without unit, not '3 m'"},
      {"3 %", "1", "it must be a number without unit, not '3 %'; write 0.03"},
      {"1e308 km", "m", "it is '1e308 km', which is above the range of a double"},
      {"1e99999999999 km", "m", "it is '1e99999999999 km', which is above the range of a double"},
  };
  for (const auto& [text, stated, fault] : cases) {
    const Taken taken = take(text, stated);
    EXPECT_EQ(taken.reading, UnitReading::refused) << text;
    EXPECT_EQ(taken.fault, fault) << text;
  }
}

// Slips that others know better.
TEST(Units, LeaveOtherTextsAlone) {
  for (const char* text : {"", "5", "deg", "any", "1,5 m", "10,5", "1 000", "0x1f", "1O", "2*pi", "010 deg", "1.2.3 m",
                           "20 // s", ".inf m", "- 5 m", "5 m, 6 m"}) {
    const Taken taken = take(text, "m");
    EXPECT_TRUE(taken.reading == UnitReading::none || taken.fault.find("unknown unit") != std::string::npos) << text;
  }
  EXPECT_EQ(take("0x1f", "m").reading, UnitReading::none);
  EXPECT_EQ(take("1O", "m").reading, UnitReading::none);
  EXPECT_FALSE(std::regex_match("0x1f", std::regex(number_with_unit_pattern())));
  EXPECT_FALSE(std::regex_match("5 kgs", std::regex(number_with_unit_pattern())));
}

TEST(Units, AreRefusedOnce) {
  Node node;
  node.kind = Node::Kind::scalar;
  node.text = "5 m";
  FaultList faults;
  EXPECT_EQ(take_unit(node, "s", "it", faults), UnitReading::refused);
  EXPECT_EQ(take_unit(node, "s", "it", faults), UnitReading::refused);
  EXPECT_EQ(faults.size(), 1u);
}

}  // namespace units_test
}  // namespace grapnel
