#pragma once

/// @file
/// The program as its users run it: in a separate folder, with exit code and both outputs. For tests of the program.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace grapnel::test {

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

struct Outcome {
  int code;  // -1: it crashed
  std::string out, err;
};

/// What a run had to say on stderr besides its progress, which a slow machine sees.
inline std::string complaints(const Outcome& o) {
  return o.err.find("warning") == std::string::npos && o.err.find("error") == std::string::npos ? "" : o.err;
}

/// A test with its own folder, removed afterwards.
class ProgramRun : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("grapnel-" + std::string(info->name()) + "-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Runs `grapnel ARGUMENTS` in the folder; the arguments are the shell's to read.
  Outcome run(const std::string& arguments) const {
    const std::filesystem::path out = folder_ / "stdout", err = folder_ / "stderr";
    const std::string command = "cd '" + folder_.string() + "' && '" GRAPNEL_PROGRAM "' " + arguments + " >'" +
                                out.string() + "' 2>'" + err.string() + "' </dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(out), read_text(err)};
  }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  static std::string scenario(const std::string& name) { return GRAPNEL_SOURCE_DIR "/scenarios/" + name; }

  std::filesystem::path folder_;
};

}  // namespace grapnel::test
