// grapnel export-fmu: a capture as an FMU for co-simulation.
#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <set>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/control/fmu_archive.hpp"
#include "grapnel/plant/model_description_text.hpp"
#include "grapnel/plant/plant_package.hpp"
#include "grapnel/plant/plant_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLicenses =
    R"(The binary in this FMU contains Grapnel (Apache License 2.0), and of headers Eigen (MPL 2.0), JSON for Modern C++
(MIT) and Random123 (BSD). Beside it lie, as Debian distributes them, {fmt} (MIT), NLopt (MIT; parts LGPL 2.1 or later),
pugixml (MIT) and yaml-cpp (MIT). Their texts are in /usr/share/doc/*/copyright of Debian.
)";

// ---- The binary ----

// In the program's folder, both in the build tree and when installed.
fs::path plant_library() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path library = program.parent_path().parent_path() / "lib" / "grapnel" / "grapnel-fmu.so";
  if (!fs::exists(library, error))
    throw PlantError(
        fmt::format("the binary of FMUs, {}, does not exist. Build it with: cmake --build "
                    "--preset release --target grapnel_fmu; a full build and the packages contain it",
                    library.string()));
  return library;
}

// Libraries that are installed on every system that runs C++ programs.
bool is_ordinary(const std::string& name) {
  constexpr std::array kOrdinary = {"libc.so",  "libm.so",       "libdl.so",    "libpthread.so",
                                    "librt.so", "libstdc++.so.", "libgcc_s.so", "ld-linux"};
  return std::any_of(kOrdinary.begin(), kOrdinary.end(), [&](const char* one) { return name.starts_with(one); });
}

// Names of the libraries that a loaded library requires (DT_NEEDED).
std::vector<std::string> needed_by(const link_map& library) {
  const char* names = nullptr;
  for (const ElfW(Dyn)* d = library.l_ld; d->d_tag != DT_NULL; ++d) {
    if (d->d_tag == DT_STRTAB) names = reinterpret_cast<const char*>(d->d_un.d_ptr);
  }
  std::vector<std::string> needed;
  for (const ElfW(Dyn)* d = library.l_ld; names && d->d_tag != DT_NULL; ++d) {
    if (d->d_tag == DT_NEEDED) needed.emplace_back(names + d->d_un.d_val);
  }
  return needed;
}

// Shared libraries that the binary requires beyond those of every system: the name and the path on this machine, as the
// system's loader resolves it.
std::vector<std::pair<std::string, fs::path>> libraries_of(const fs::path& binary) {
  struct Library {
    void* handle;
    ~Library() {
      if (handle) ::dlclose(handle);
    }
  } const library{::dlopen(binary.c_str(), RTLD_LAZY | RTLD_LOCAL)};
  link_map* map = nullptr;
  if (!library.handle || ::dlinfo(library.handle, RTLD_DI_LINKMAP, &map) != 0) {
    const char* const why = ::dlerror();
    throw PlantError(fmt::format("{} cannot be loaded: {}", binary.string(), why ? why : "unknown reason"));
  }
  const auto loaded = [&](const std::string& name) -> const link_map* {
    for (const link_map* one = map; one; one = one->l_next) {
      if (fs::path(one->l_name).filename() == name) return one;
    }
    for (const link_map* one = map->l_prev; one; one = one->l_prev) {
      if (fs::path(one->l_name).filename() == name) return one;
    }
    return nullptr;
  };
  std::vector<std::pair<std::string, fs::path>> found;
  std::set<std::string> seen;
  std::vector<std::string> open = needed_by(*map);
  while (!open.empty()) {
    const std::string name = open.back();
    open.pop_back();
    if (is_ordinary(name) || !seen.insert(name).second) continue;
    const link_map* const one = loaded(name);
    if (!one) throw PlantError(fmt::format("the library {} of {} is not found", name, binary.string()));
    found.emplace_back(name, one->l_name);
    for (std::string& more : needed_by(*one)) open.push_back(std::move(more));
  }
  return found;
}

// ---- The archive ----

void put_copy(const fs::path& from, const fs::path& to) {
  fs::create_directories(to.parent_path());
  fs::copy_file(from, to);
}

void write_folder(const fs::path& folder, const PlantDescription& description, const GatheredPlant& gathered,
                  const PlantVariables& variables) {
  write_file_atomically(folder / "modelDescription.xml", model_description_text(description, variables));
  const fs::path resources = folder / "resources";
  for (const GatheredPlant::File& file : gathered.files) put_copy(file.from, resources / file.to);
  write_file_atomically(resources / kPlantFile, plant_json(gathered.package));
  const fs::path binaries = folder / "binaries" / (description.version == 2 ? "linux64" : "x86_64-linux");
  const fs::path library = plant_library();
  put_copy(library, binaries / (description.identifier + ".so"));
  for (const auto& [name, place] : libraries_of(library)) put_copy(place, binaries / name);
  fs::create_directories(folder / "documentation" / "licenses");
  write_file_atomically(folder / "documentation" / "licenses" / "license.txt", kLicenses);
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

PlantDescription describe(const ExportFmuOptions& options, const CaptureProblem& plant) {
  PlantDescription description;
  description.version = options.version;
  description.name = plant.name.empty() ? options.scenario.stem().string() : plant.name;
  description.identifier = c_identifier(options.scenario.stem().string());
  description.tool = "Grapnel " GRAPNEL_VERSION;
  description.period = plant.control->timing.period;
  description.stop = (plant.approach ? plant.approach->duration : 0) + plant.post_impact.total_duration();
  return description;
}

}  // namespace

int export_fmu(const ExportFmuOptions& options) {
  try {
    const std::vector<std::string> parameters =
        options.parameters.empty() ? std::vector<std::string>{"default"} : options.parameters;
    std::vector<Fault> warnings;
    GatheredPlant gathered =
        gather_plant(options.scenario, options.overrides, parameters, options.base_torque, &warnings);
    const fs::path output =
        options.output.empty() ? fs::path(options.scenario.stem().string() + ".fmu") : options.output;
    Terminal terminal;
    if (!may_write({output}, terminal)) return kBadInput;
    print_errors(warnings);
    if (!gathered.assumed.empty())
      to_stdout("The scenario has no control.period: {} is used; change it with --set.\n", gathered.assumed);
    const PlantVariables variables = plant_variables(gathered.plant, gathered.package.parameters);
    PlantDescription description = describe(options, gathered.plant);
    // Computed over the whole package, so that a binary rejects the resources of another one.
    description.token = gathered.package.token =
        "{" +
        sha256(model_description_text(description, variables) + plant_json(gathered.package) + gathered.plant.sha256) +
        "}";
    const ScratchFolder folder, archive;
    write_folder(folder.path(), description, gathered, variables);
    fmi::zip_folder(folder.path(), archive.path() / "plant.fmu");
    write_file_atomically(output, bytes_of(archive.path() / "plant.fmu"));
    to_stdout("{}: FMI {}.0, {}, {}, {}; a step is {} s\n", output.string(), options.version,
              counted(variables.inputs, "input"), counted(variables.outputs, "output"),
              counted(variables.parameters, "parameter"), description.period);
#ifdef GRAPNEL_NATIVE
    to_stdout(
        "Its binary is tuned to this machine's processor, like this program; for FMUs that run on any x86-64, use a "
        "program "
        "built with -DGRAPNEL_NATIVE=OFF.\n");
#endif
    return kDone;
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  } catch (const PlantError& error) {
    to_stderr("grapnel: error: {}: {}\n", options.scenario.string(), error_text(error));
    return kBadInput;
  } catch (const CaptureProblemError& error) {
    to_stderr("grapnel: error: {}: {}\n", options.scenario.string(), error_text(error));
    return kBadInput;
  } catch (const std::runtime_error& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kSimulationFailed;
  }
}

}  // namespace grapnel::app
