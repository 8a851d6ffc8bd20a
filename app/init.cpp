#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "commands.hpp"
#include "grapnel/scenario/ready_made.hpp"
#include "grapnel/text/message_text.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

void print_list(ReadyMade::Kind kind, const char* head) {
  to_stdout("{}\n", head);
  for (const ReadyMade& one : ready_made(kind)) {
    if (one.name == "campaign-scenario") continue;  // written together with the campaign
    to_stdout("  {:<32}{}\n", one.name, one.description());
  }
}

int print_ready_made() {
  print_list(ReadyMade::Kind::templates, "Templates, written by: grapnel init NAME");
  print_list(ReadyMade::Kind::robots, "\nRobots, used in a scenario as robot: NAME, described by: grapnel info NAME");
  print_list(ReadyMade::Kind::targets,
             "\nTargets, used in a scenario as ready_made: NAME, described by: grapnel info NAME");
  return kDone;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

struct NewFile {
  fs::path path;
  std::string text;
};

// The files of a template; references between them use the names under which they are written.
std::vector<NewFile> files_of(const ReadyMade& one, const fs::path& path) {
  const std::string name(one.name), stem = path.stem().string();
  std::string text(one.text);
  std::vector<NewFile> files;
  if (name == "campaign") {
    const ReadyMade& scenario = *find_ready_made(ReadyMade::Kind::templates, "campaign-scenario");
    const std::string own = stem + "-scenario";
    const fs::path beside = path.parent_path() / (own + ".yaml");
    files.push_back({beside, replaced(std::string(scenario.text), "campaign-scenario.yaml", own + ".yaml")});
    text = replaced(text, "campaign-scenario.yaml", own + ".yaml");
  }
  text = replaced(text, " " + name + ".yaml", " " + shell_word(path.string()));
  text = replaced(text, "out/" + name, "out/" + stem);
  files.insert(files.begin(), {path, std::move(text)});
  return files;
}

// Writes a new file. An existing file remains unchanged: prints an error and returns false.
bool write_new(const NewFile& file) {
  const std::string path = file.path.string();
  std::FILE* const stream = std::fopen(path.c_str(), "wx");
  if (!stream) {
    const std::string why = errno == EEXIST ? " already exists; name another file with -o, or remove it"
                                            : fmt::format(" cannot be written: {}", std::strerror(errno));
    to_stderr("grapnel: error: {}{}\n", printable_line(path), why);
    return false;
  }
  const bool written = std::fwrite(file.text.data(), 1, file.text.size(), stream) == file.text.size();
  const bool closed = std::fclose(stream) == 0;
  if (!written || !closed) to_stderr("grapnel: error: {} cannot be written: {}\n", path, std::strerror(errno));
  return written && closed;
}

}  // namespace

int init(const InitOptions& options) {
  if (options.list) return print_ready_made();
  const ReadyMade* found = find_ready_made(ReadyMade::Kind::templates, options.name);
  if (!found) {
    to_stderr("grapnel: error: {}\n", no_ready_made(ReadyMade::Kind::templates, options.name));
    return kBadInput;
  }
  const fs::path path = options.output.empty() ? fs::path(options.name + ".yaml") : options.output;
  const std::vector<NewFile> files = files_of(*found, path);
  for (const NewFile& file : files) {
    std::error_code error;
    if (!fs::exists(fs::symlink_status(file.path, error))) continue;
    to_stderr("grapnel: error: {} already exists; name another file with -o, or remove it\n",
              printable_line(file.path.string()));
    return kBadInput;
  }
  for (const NewFile& file : files) {
    if (!write_new(file)) return kBadInput;
    to_stdout("{}\n", printable_line(file.path.string()));
  }
  const char* command = options.name == "campaign" ? "campaign" : options.name == "robot" ? "info" : "run";
  to_stdout("next: grapnel {} {}\n", command, shell_word(path.string()));
  return kDone;
}

}  // namespace grapnel::app
