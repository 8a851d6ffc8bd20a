/// The table of signals and its documentation.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "grapnel/control/controller_signals.hpp"

namespace grapnel::testing {
namespace controller_signals_test {

std::string owner_text(const ControllerSignal& signal) {
  const std::string owner = owner_name(signal.owner);
  return signal.size == 1 ? owner : owner + ", " + std::to_string(signal.size) + " numbers";
}

std::string plant_text(const ControllerSignal& signal) {
  if (!signal.plant) return "of FMI";
  std::string owner = owner_name(signal.owner);
  std::replace(owner.begin(), owner.end(), '-', '_');
  const std::string prefix = signal.owner == SignalOwner::run    ? ""
                             : signal.owner == SignalOwner::base ? "base."
                                                                 : owner + ".NAME.";
  return "`" + prefix + signal.plant + "`";
}

std::string column_text(const CommandSignal& command) {
  const std::string column = command.column;
  if (command.about.owner != SignalOwner::base) return "`" + column + "NAME`";
  return "`" + column + "x`, `" + column + "y`, `" + column + "z`";
}

std::string documentation() {
  std::string text = "| Reading | Owner | Unit | Exported plant | Meaning |\n|---|---|---|---|---|\n";
  for (const InputSignal& input : input_signals) {
    const ControllerSignal& s = input.about;
    text += std::string("| `") + s.name + "`" + (input.needs_sensor ? "*" : "") + " | " + owner_text(s) + " | " +
            signal_unit(s) + " | " + plant_text(s) + " | " + s.text + " |\n";
  }
  text += "\n| Command | Owner | Unit | Exported plant | Torque file | Meaning |\n|---|---|---|---|---|---|\n";
  for (const CommandSignal& command : command_signals) {
    const ControllerSignal& s = command.about;
    text += std::string("| `") + s.name + "` | " + owner_text(s) + " | " + signal_unit(s) + " | " + plant_text(s) +
            " | " + column_text(command) + " | " + s.text + " |\n";
  }
  return text;
}

TEST(ControllerSignals, AreDocumented) {
  std::ifstream page(GRAPNEL_SIGNALS_PAGE);
  std::stringstream text;
  text << page.rdbuf();
  EXPECT_NE(text.str().find(documentation()), std::string::npos)
      << "the tables of signals in " GRAPNEL_SIGNALS_PAGE " must be:\n"
      << documentation();
}

TEST(ControllerSignals, HaveUniqueNames) {
  std::set<std::string> readings, commands;
  for (const InputSignal& input : input_signals) EXPECT_TRUE(readings.insert(input.about.name).second);
  for (const CommandSignal& command : command_signals) EXPECT_TRUE(commands.insert(command.about.name).second);
  EXPECT_THROW(input_signal("nothing"), std::logic_error);
}

// A plugin that was compiled with an earlier header sees the members of that header in the same places.
TEST(ControllerSignals, KeepTheLayoutOfTheCInterface) {
  EXPECT_EQ(offsetof(grapnel_controller_setup, base_torque), 48u);
  EXPECT_EQ(offsetof(grapnel_controller_setup, base_actuators), 56u);
  EXPECT_EQ(offsetof(grapnel_controller_input, base_angular_velocity), 144u);
  EXPECT_EQ(offsetof(grapnel_controller_input, target_motion), 216u);
  EXPECT_EQ(offsetof(grapnel_controller_input, gyros), 224u);
  EXPECT_EQ(offsetof(grapnel_controller_output, base_torque), 16u);
  EXPECT_EQ(offsetof(grapnel_controller_output, wheel_torque), 40u);
}

}  // namespace controller_signals_test
}  // namespace grapnel::testing
