#include "grapnel/result/hdf5_handle.hpp"

#include <algorithm>
#include <stdexcept>

namespace grapnel::hdf5 {
namespace {

std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

bool is_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

/// What HDF5 allocated for variable-length strings goes back to it.
struct StringBuffer {
  const Handle& type;
  const Handle& space;
  std::vector<char*> strings;
  ~StringBuffer() { H5Dvlen_reclaim(type.id(), space.id(), H5P_DEFAULT, strings.data()); }
};

// HDF5 reports what the system says among times, addresses and sizes.
std::string system_reason(const std::string& reason) {
  const std::string before = "error message = '";
  const std::size_t begin = reason.find(before);
  if (begin == std::string::npos) return reason;
  const std::size_t end = reason.find('\'', begin + before.size());
  return end == std::string::npos ? reason : reason.substr(begin + before.size(), end - begin - before.size());
}

}  // namespace

Session::Session() : lock_(library_mutex()) {
  // Before anything else is asked of the library. A file that could not be written, on a full disk, could not be closed
  // either: HDF5 would try it once more when the program ends, and crash.
  [[maybe_unused]] static const herr_t no_second_try = H5dont_atexit();
  H5Eget_auto2(H5E_DEFAULT, &print_, &print_data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Session::~Session() { H5Eset_auto2(H5E_DEFAULT, print_, print_data_); }

void fail(const std::string& what) {
  std::string reason;  // of the innermost failure
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* error, void* data) -> herr_t {
        if (n == 0 && error->desc != nullptr) *static_cast<std::string*>(data) = error->desc;
        return 0;
      },
      &reason);
  reason = system_reason(reason);
  throw std::runtime_error(reason.empty() ? what : what + " (" + reason + ")");
}

Handle string_type(bool ascii) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "string type");
  check(H5Tset_size(type.id(), H5T_VARIABLE), "string type");
  check(H5Tset_cset(type.id(), ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8), "string type");
  return type;
}

void write_attribute(const Handle& object, const char* name, const std::string& value) {
  const Handle type = string_type(is_ascii(value));
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute(H5Acreate2(object.id(), name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         name);
  const char* text = value.c_str();
  check(H5Awrite(attribute.id(), type.id(), &text), name);
}

void write_attribute(const Handle& object, const char* name, const std::vector<std::string>& values) {
  const Handle type = string_type(std::all_of(values.begin(), values.end(), is_ascii));
  const hsize_t count = values.size();
  const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose, name);
  const Handle attribute(H5Acreate2(object.id(), name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         name);
  std::vector<const char*> texts;
  texts.reserve(values.size());
  for (const std::string& value : values) texts.push_back(value.c_str());
  check(H5Awrite(attribute.id(), type.id(), texts.data()), name);
}

void write_attribute(const Handle& object, const char* name, int value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute(H5Acreate2(object.id(), name, H5T_STD_I32LE, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         name);
  check(H5Awrite(attribute.id(), H5T_NATIVE_INT, &value), name);
}

std::vector<std::string> read_strings_attribute(const Handle& object, const char* name) {
  const std::string what = "attribute '" + std::string(name) + "'";
  const Handle attribute(H5Aopen(object.id(), name, H5P_DEFAULT), H5Aclose, what);
  const Handle stored(H5Aget_type(attribute.id()), H5Tclose, what);
  if (H5Tget_class(stored.id()) != H5T_STRING || H5Tis_variable_str(stored.id()) <= 0) {
    throw std::runtime_error(what + " is not a variable-length string");
  }
  const Handle space(H5Aget_space(attribute.id()), H5Sclose, what);
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  constexpr hssize_t kMost = 1 << 16;  // attributes hold at most 64 KiB
  if (count < 0 || count > kMost) throw std::runtime_error(what + " has an impossible size");
  const Handle type = string_type(H5Tget_cset(stored.id()) == H5T_CSET_ASCII);
  StringBuffer buffer{type, space, std::vector<char*>(static_cast<std::size_t>(count), nullptr)};
  if (count > 0) check(H5Aread(attribute.id(), type.id(), buffer.strings.data()), what);
  std::vector<std::string> values;
  for (const char* text : buffer.strings) values.emplace_back(text != nullptr ? text : "");
  return values;
}

std::string read_string_attribute(const Handle& object, const char* name) {
  const std::vector<std::string> values = read_strings_attribute(object, name);
  if (values.size() != 1) throw std::runtime_error("attribute '" + std::string(name) + "' is not one string");
  return values.front();
}

int read_int_attribute(const Handle& object, const char* name, int fallback) {
  if (H5Aexists(object.id(), name) <= 0) return fallback;
  const Handle attribute(H5Aopen(object.id(), name, H5P_DEFAULT), H5Aclose, name);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose, name);
  if (H5Sget_simple_extent_npoints(space.id()) != 1) return fallback;
  int value = fallback;
  check(H5Aread(attribute.id(), H5T_NATIVE_INT, &value), name);
  return value;
}

}  // namespace grapnel::hdf5
