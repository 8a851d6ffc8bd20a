#include "grapnel/import/assembly_steps.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

std::string lower_ending(const fs::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return ending;
}

// A file within a ROS package.
struct InPackage {
  std::string package;
  fs::path rest;
};

// package://NAME/rest, model://NAME/rest, $(find NAME)/rest, also behind file://.
std::optional<InPackage> in_package(std::string_view named) {
  if (named.starts_with("file://$(find ")) named.remove_prefix(7);
  std::size_t end = std::string_view::npos;
  if (named.starts_with("$(find ")) {
    named.remove_prefix(7);
    end = named.find(')');
  } else if (named.starts_with("package://") || named.starts_with("model://")) {
    named.remove_prefix(named.find("//") + 2);
    end = named.find('/');
  }
  if (end == std::string_view::npos) return {};
  std::string_view rest = named.substr(end + 1);
  while (rest.starts_with('/')) rest.remove_prefix(1);
  return InPackage{std::string(named.substr(0, end)), fs::path(rest)};
}

FoundMesh find_in_package(const InPackage& in, const ImportOptions& options) {
  for (const PackageFolder& one : options.packages) {
    if (one.name != in.package) continue;
    const fs::path file = one.folder / in.rest;
    if (is_file(file)) return {file, {}};
    return {{}, fmt::format("the folder given for package {} has no such file", in_quotes(in.package))};
  }
  std::error_code error;
  const fs::path folder = fs::absolute(options.source, error).lexically_normal().parent_path();
  for (fs::path above = folder;; above = above.parent_path()) {
    if (above.filename() == in.package && is_file(above / in.rest)) return {above / in.rest, {}};
    if (is_file(above / in.package / in.rest)) return {above / in.package / in.rest, {}};
    if (above == above.parent_path()) break;
  }
  // A package that was copied or cloned under another name: the description next to its meshes.
  for (const fs::path& above : {folder, folder.parent_path(), folder.parent_path().parent_path()}) {
    if (is_file(above / in.rest)) return {above / in.rest, {}};
  }
  return {{},
          fmt::format("package {} was not found near the file; give its folder: package {}=FOLDER",
                      in_quotes(in.package), shell_word(in.package))};
}

}  // namespace

FoundMesh find_mesh(const std::string& named, const ImportOptions& options) {
  const auto package = in_package(named);
  const std::string ending = lower_ending(package ? package->rest : fs::path(named));
  if (ending != ".stl" && ending != ".obj" && ending != ".dae")
    return {{},
            ending.empty() ? "it has no extension; .stl, .obj and .dae are read"
                           : fmt::format("{} files are not read; .stl, .obj and .dae are", printable_line(ending))};
  FoundMesh found;
  if (package) {
    found = find_in_package(*package, options);
  } else if (named.starts_with("http://") || named.starts_with("https://")) {
    found.why_not = "it does not exist on this machine";
  } else {
    const std::string path = named.starts_with("file://") ? named.substr(7) : named;
    found.file = options.source.parent_path() / path;
    if (!is_file(found.file)) found = {{}, "there is no such file"};
  }
  if (found.file.empty()) return found;
  std::error_code error;
  found.file = fs::absolute(found.file, error).lexically_normal();
  std::string fault = options.mesh_fault ? options.mesh_fault(found.file) : std::string();
  if (!fault.empty()) return {{}, std::move(fault)};
  return found;
}

}  // namespace grapnel
