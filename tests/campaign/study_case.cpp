#include "campaign/study_case.hpp"

#include <fstream>
#include <sstream>

namespace grapnel::test {

namespace fs = std::filesystem;

fs::path Folder::write(const std::string& name, const std::string& text) const {
  std::ofstream(path() / name, std::ios::binary) << text;
  return path() / name;
}

std::string read_bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string shipped(const std::string& name) { return std::string(GRAPNEL_SOURCE_DIR "/") + name; }

std::string impact_at_once() {
  std::string text = read_bytes(shipped("scenarios/seven-joint-dual-capture.yaml"));
  const auto cut = [&](const std::string& from, const std::string& to) {
    const std::size_t a = text.find(from);
    text.erase(a, text.find(to) - a);
  };
  cut("initial:", "targets:");
  cut("approach:", "contact:");
  cut("post_impact:", "output:");
  text.replace(text.find("../robots"), 9, GRAPNEL_SOURCE_DIR "/robots");
  const std::string gap = "gap: weld_as_found";  // the end-effectors are 0.4 m away
  text.replace(text.find(gap), gap.size(), gap + ", largest_gap: any");
  return text +
         "initial:\n"
         "  base: {velocity: [0.01, -0.02, 0.03], angular_velocity: [0.02, 0.01, -0.03]}\n"
         "  joints: [0.4, 0.4, 0.1, -0.6, -2.0, -2.7, -0.2, 0.5, 0.4, -0.3, 0.2, -2.1, -2.7, -0.1]\n"
         "  joint_rates: [0.01, -0.02, 0.03, 0, 0.01, 0.02, -0.01, 0.02, 0.01, 0, -0.03, 0.01, 0, 0.02]\n";
}

}  // namespace grapnel::test
