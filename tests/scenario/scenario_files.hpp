#pragma once

/// @file
/// Scenario files for tests.

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel::test {

/// A folder that lives as long as the object.
class TemporaryFolder : public ScratchFolder {
 public:
  /// Writes a file and returns its path.
  std::filesystem::path write(const std::string& name, std::string_view bytes) const;
};

/// A small valid scenario with its robot inline: a two-joint arm that captures one ball.
extern const char* const kSmallScenario;
/// The robot of kSmallScenario as a separate file.
std::string small_robot();

/// The text with each first string, which must occur exactly once, replaced by the second.
std::string edited(std::string text, const std::vector<std::pair<std::string, std::string>>& edits);

/// Fault texts of a scenario or robot with this content, without the folder's path; empty if it is accepted.
std::vector<std::string> faults_of(std::string_view text, const std::vector<Override>& overrides = {});
std::vector<std::string> robot_faults_of(std::string_view text);
/// Warning texts of a scenario with this content, which must be without faults.
std::vector<std::string> warnings_of(std::string_view text, const std::vector<Override>& overrides = {});
/// Fault texts of a file, with the folder's path removed.
std::vector<std::string> faults_of_file(const std::filesystem::path& path, const std::vector<Override>& overrides = {});

/// The bytes of a file.
std::string bytes_of(const std::filesystem::path& path);
/// Every robot or scenario file of the repository.
std::vector<std::filesystem::path> shipped_robots();
std::vector<std::filesystem::path> shipped_scenarios();

/// Edits of kSmallScenario: further keys of the end-effector, the grasp point, the grasp, post_impact (each in braces:
/// "key: value"), a further line of the approach or of the scenario, an external wrench, and the text in the place
/// of final_joints and final_rates.
using Edit = std::pair<std::string, std::string>;
Edit with_tip(const std::string& keys);
Edit with_point(const std::string& keys);
Edit with_grasp(const std::string& keys);
Edit with_post_impact(const std::string& keys);
Edit with_approach(const std::string& line);
Edit with_top(const std::string& line);
Edit with_wrench(const std::string& wrench);
Edit way(const std::string& lines);

struct FaultCase {
  const char* name;
  std::vector<Edit> edits;          // of kSmallScenario
  std::vector<std::string> faults;  // all of them, in order
};

}  // namespace grapnel::test
