/// @file
/// One input of the fuzzer: a scenario, and other input of the command line.
///
/// The bytes are a scenario file. Five separator lines, each at most once and in this order, begin further parts:
///
///     === robot.yaml       a file of that name beside the scenario
///     === motion.csv       same
///     === mesh.obj         same
///     === mesh.stl         same
///     === set              overrides, one path=value per line
///
/// Every input must be rejected with an InputError that has faults, or accepted. An accepted input must yield a model,
/// or be rejected by the model's own errors. Anything else ends the process: an exception of another type, a signal, a
/// sanitizer's finding, a hang.

#include "fuzz/fuzz_scenario.hpp"

#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel::fuzz {
namespace {

namespace fs = std::filesystem;

// A private folder, in memory where the system has such a place; removed at the end of the process.
class Folder {
 public:
  Folder() {
    const fs::path memory = "/dev/shm";
    std::error_code error;
    const fs::path parent = fs::is_directory(memory, error) ? memory : fs::temp_directory_path();
    std::string name = (parent / "grapnel-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  fs::path write(const char* name, std::string_view bytes) const {
    std::ofstream file(path_ / name, std::ios::binary | std::ios::trunc);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!file.flush()) throw std::runtime_error("cannot write " + (path_ / name).string());
    return path_ / name;
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// Splits the text at a separator line; returns the part after it, if present.
std::optional<std::string_view> cut(std::string_view& text, std::string_view line) {
  const std::string whole = "\n" + std::string(line) + "\n";
  const std::size_t at = text.find(whole);
  if (at == std::string_view::npos) return {};
  const std::string_view rest = text.substr(at + whole.size());
  text = text.substr(0, at + 1);
  return rest;
}

// Writes a file of the input, or removes that of the previous input; returns whether it exists.
bool place(const Folder& folder, const char* name, std::optional<std::string_view> bytes) {
  if (bytes) folder.write(name, *bytes);
  if (!bytes) fs::remove(folder.path() / name);
  return bytes.has_value();
}

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (end > 0) lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

// A fault or warning that is not a single printable line is a bug as well.
void require_sound(const std::vector<Fault>& faults) {
  for (const Fault& fault : faults) {
    const std::string text = fault.text();
    const bool sound = !fault.message.empty() && fault.line >= 0 && fault.column >= 0 &&
                       fault.message.size() <= FaultList::kLongestMessage + 3 && text == printable_line(text);
    if (!sound) throw std::logic_error("a malformed fault: " + text);
  }
}

Outcome refusal(const InputError& error) {
  if (error.faults().empty()) throw std::logic_error("a InputError without faults");
  require_sound(error.faults());
  return Outcome::refused;
}

Outcome load_and_build(const fs::path& scenario, const std::vector<std::string>& arguments) {
  CaptureProblem problem;
  try {
    std::vector<Override> overrides;
    for (const std::string& argument : arguments) overrides.push_back(parse_override(argument));
    std::vector<Fault> warnings;
    problem = load_scenario(scenario, overrides, &warnings);
    require_sound(warnings);
  } catch (const InputError& error) {
    return refusal(error);
  }
  try {
    make_capture_system(problem);
    return Outcome::built;
  } catch (const CaptureProblemError&) {
  } catch (const ModelError&) {
  }
  return Outcome::no_system;
}

}  // namespace

Outcome try_input(std::string_view bytes) {
  static const Folder folder;
  const auto set = cut(bytes, "=== set");
  place(folder, "mesh.stl", cut(bytes, "=== mesh.stl"));
  place(folder, "mesh.obj", cut(bytes, "=== mesh.obj"));
  place(folder, "motion.csv", cut(bytes, "=== motion.csv"));
  const bool robot = place(folder, "robot.yaml", cut(bytes, "=== robot.yaml"));
  if (robot) {
    try {
      load_robot(folder.path() / "robot.yaml");
    } catch (const InputError& error) {
      refusal(error);
    }
  }
  return load_and_build(folder.write("scenario.yaml", bytes), lines_of(set.value_or("")));
}

}  // namespace grapnel::fuzz
