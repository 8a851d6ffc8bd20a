#include "grapnel/fmi/fmu.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstdint>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "grapnel/fmi/fmi_functions.hpp"
#include "grapnel/plugin/guarded_call.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::fmi {
namespace {

namespace fs = std::filesystem;

// Limit of the unpacked size: an archive may state any size.
constexpr std::uint64_t kLargest = 2'000'000'000;

std::string zip_reason(int code) {
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  std::string text = zip_error_strerror(&error);
  zip_error_fini(&error);
  return text;
}

// The path of an entry below the folder. @throws FmuError if it would be outside.
fs::path place_of(const fs::path& folder, const std::string& name) {
  const fs::path path(name);
  const bool leaves = path.is_absolute() || std::find(path.begin(), path.end(), "..") != path.end();
  if (leaves || name.find('\\') != std::string::npos)
    throw FmuError(fmt::format("its archive has an entry {}, whose path is outside the archive", in_quotes(name)));
  return folder / path;
}

void unpack_entry(zip_t* archive, zip_uint64_t i, const fs::path& folder, std::uint64_t& left) {
  zip_stat_t about;
  if (zip_stat_index(archive, i, 0, &about) != 0) throw FmuError("its archive is damaged");
  const std::string name = about.name;
  const fs::path place = place_of(folder, name);
  if (name.ends_with('/')) {
    fs::create_directories(place);
    return;
  }
  fs::create_directories(place.parent_path());
  zip_file_t* const entry = zip_fopen_index(archive, i, 0);
  if (!entry)
    throw FmuError(fmt::format("{} of its archive cannot be read: {}", in_quotes(name), zip_strerror(archive)));
  std::ofstream out(place, std::ios::binary);
  std::vector<char> buffer(1 << 16);
  zip_int64_t count = 0;
  while ((count = zip_fread(entry, buffer.data(), buffer.size())) > 0 && static_cast<std::uint64_t>(count) <= left) {
    out.write(buffer.data(), count);
    left -= static_cast<std::uint64_t>(count);
  }
  const bool is_sound = zip_fclose(entry) == 0 && count == 0;
  if (count > 0) throw FmuError(fmt::format("its unpacked size is above {} bytes", kLargest));
  if (!is_sound) throw FmuError(fmt::format("{} of its archive is damaged", in_quotes(name)));
  if (!out.flush()) throw FmuError(fmt::format("{} cannot be written", place.string()));
}

void unpack(const fs::path& file, const fs::path& folder) {
  int code = 0;
  zip_t* const archive = zip_open(file.c_str(), ZIP_RDONLY, &code);
  if (!archive) throw FmuError(fmt::format("it is not a readable ZIP archive: {}", zip_reason(code)));
  const std::unique_ptr<zip_t, void (*)(zip_t*)> closes(archive, zip_discard);
  std::uint64_t left = kLargest;
  const zip_int64_t count = zip_get_num_entries(archive, 0);
  for (zip_int64_t i = 0; i < count; ++i) unpack_entry(archive, static_cast<zip_uint64_t>(i), folder, left);
}

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
    unpack(file, folder_.path());
    model_ = read_model_description(bytes_of(folder_.path() / "modelDescription.xml"));
    turn_ = turn_of(model_);
    const fs::path binary = binary_of(folder_.path(), model_);
    const PluginCall blame(named_.c_str(), "the code that runs when it is loaded", 0);
    const FloatingPointGuard kept;
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

void zip_folder(const fs::path& folder, const fs::path& archive) {
  int code = 0;
  zip_t* const zip = zip_open(archive.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  if (!zip) throw FmuError(fmt::format("{} cannot be written: {}", archive.string(), zip_reason(code)));
  std::unique_ptr<zip_t, void (*)(zip_t*)> discards(zip, zip_discard);
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    zip_source_t* const bytes = zip_source_file(zip, file.c_str(), 0, -1);
    const std::string name = fs::relative(file, folder).generic_string();
    const zip_int64_t index = bytes ? zip_file_add(zip, name.c_str(), bytes, ZIP_FL_ENC_UTF_8) : -1;
    if (index < 0) {
      zip_source_free(bytes);
      throw FmuError(fmt::format("{} cannot be added: {}", name, zip_strerror(zip)));
    }
    zip_file_set_mtime(zip, static_cast<zip_uint64_t>(index), 0, 0);
    zip_set_file_compression(zip, static_cast<zip_uint64_t>(index), ZIP_CM_DEFLATE, 1);
  }
  if (zip_close(zip) != 0) throw FmuError(fmt::format("{} cannot be written: {}", archive.string(), zip_strerror(zip)));
  static_cast<void>(discards.release());
}

}  // namespace grapnel::fmi
