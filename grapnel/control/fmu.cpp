#include "grapnel/control/fmu.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "grapnel/control/fmi_functions.hpp"
#include "grapnel/control/fmu_archive.hpp"
#include "grapnel/control/guarded_call.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::fmi {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw FmuError("it has no modelDescription.xml");
  return {std::istreambuf_iterator<char>(in), {}};
}

// The binary for this system.
fs::path binary_of(const fs::path& folder, const ModelDescription& model) {
  const char* const platform = model.version == 2 ? "linux64" : "x86_64-linux";
  const fs::path file = folder / "binaries" / platform / (model.identifier + ".so");
  if (fs::exists(file)) return file;
  std::vector<std::string> others;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "binaries", none))
    others.push_back(entry.path().filename().string());
  std::sort(others.begin(), others.end());
  throw FmuError(fmt::format("it has no binary for this system, binaries/{}/{}.so; {}", platform, model.identifier,
                             others.empty() ? "it has none for any system" : "it has: " + some_of(others)));
}

}  // namespace

struct Fmu::Turn {
  std::mutex mutex;
  std::condition_variable freed;
  bool taken = false;
  std::thread::id by;
};

// A scenario may be read many times in one process: FMUs with the same token share one turn.
std::shared_ptr<Fmu::Turn> Fmu::turn_of(const ModelDescription& model) {
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<Turn>> turns;
  const std::lock_guard lock(mutex);
  std::shared_ptr<Turn>& turn = turns[model.identifier + " " + model.token];
  if (!turn) turn = std::make_shared<Turn>();
  return turn;
}

Fmu::Fmu(const fs::path& file, const std::string& shown) : named_(fmt::format("the FMU '{}'", shown)) {
  try {
    unpack_archive(file, folder_.path());
    model_ = read_model_description(bytes_of(folder_.path() / "modelDescription.xml"));
    turn_ = turn_of(model_);
    const fs::path binary = binary_of(folder_.path(), model_);
    const PluginCall blame(named_.c_str(), "the code that runs when it is loaded", 0);
    const FloatingPointGuard environment_guard;
    library_ = ::dlopen(binary.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library_) {
      const char* const reason = ::dlerror();
      throw FmuError(fmt::format("its binary cannot be loaded: {}", reason ? reason : "unknown reason"));
    }
    // All functions that an instance calls.
    for (const char* name : {"GetVersion", "FreeInstance", "EnterInitializationMode", "ExitInitializationMode",
                             "Terminate", "DoStep", "SetBoolean", "SetString"})
      symbol(name);
    for (const char* name :
         model_.version == 2 ? std::array{"Instantiate", "SetupExperiment", "GetReal", "SetReal", "SetInteger"}
                             : std::array{"InstantiateCoSimulation", "Reset", "GetFloat64", "SetFloat64", "SetInt32"})
      symbol(name);
    const std::string version = function<GetVersion>("GetVersion")();
    if (!version.starts_with(model_.version == 2 ? "2.0" : "3.0"))
      throw FmuError(
          fmt::format("its binary follows FMI {}, its modelDescription.xml {}.0", in_quotes(version), model_.version));
  } catch (const FmuError& error) {
    if (library_) ::dlclose(library_);
    throw FmuError(fmt::format("{}: {}", named_, error.what()));
  } catch (...) {
    if (library_) ::dlclose(library_);
    throw;
  }
}

Fmu::~Fmu() { ::dlclose(library_); }

void* Fmu::symbol(const char* name) const {
  const std::string full = fmt::format("fmi{}{}", model_.version, name);
  void* const found = ::dlsym(library_, full.c_str());
  if (!found) throw FmuError(fmt::format("its binary has no function {}()", full));
  return found;
}

void Fmu::acquire() const {
  if (!model_.once_per_process) return;
  std::unique_lock lock(turn_->mutex);
  if (turn_->taken && turn_->by == std::this_thread::get_id())
    throw FmuError("it can be instantiated only once per process, and another run of this thread holds the instance");
  turn_->freed.wait(lock, [&] { return !turn_->taken; });
  turn_->taken = true, turn_->by = std::this_thread::get_id();
}

void Fmu::release() const {
  if (!model_.once_per_process) return;
  {
    const std::lock_guard lock(turn_->mutex);
    turn_->taken = false;
  }
  turn_->freed.notify_one();
}

}  // namespace grapnel::fmi
