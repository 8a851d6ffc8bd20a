#pragma once

/// @file
/// HDF5's C API with owners and exceptions; for .cpp files that write or read tables, not for headers of others.

#include <hdf5.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace grapnel::hdf5 {

/// While it lives: this thread alone uses HDF5 (whose library need not be thread-safe), and HDF5 prints nothing.
class Session {
 public:
  Session();
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

 private:
  std::lock_guard<std::mutex> lock_;
  H5E_auto2_t print_ = nullptr;
  void* print_data_ = nullptr;
};

/// Throws std::runtime_error with `what` and the innermost entry of HDF5's error stack.
[[noreturn]] void fail(const std::string& what);

/// Owns one HDF5 identifier. Thread safety: within one Session.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  /// Throws fail(what) if `id` says that making it failed.
  Handle(hid_t id, Close close, const std::string& what) : id_(id), close_(close) {
    if (id < 0) fail(what);
  }
  ~Handle() { reset(); }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  hid_t id() const { return id_; }

 private:
  void reset() noexcept {
    if (id_ >= 0) close_(id_);
    id_ = H5I_INVALID_HID;
  }

  hid_t id_;
  Close close_;
};

inline void check(herr_t status, const std::string& what) {
  if (status < 0) fail(what);
}

/// The type of variable-length strings; marked UTF-8 only where needed, since old readers know ASCII alone.
Handle string_type(bool ascii);

void write_attribute(const Handle& object, const char* name, const std::string& value);
void write_attribute(const Handle& object, const char* name, const std::vector<std::string>& values);
void write_attribute(const Handle& object, const char* name, int value);

std::string read_string_attribute(const Handle& object, const char* name);
std::vector<std::string> read_strings_attribute(const Handle& object, const char* name);
/// `fallback` where the attribute is absent.
int read_int_attribute(const Handle& object, const char* name, int fallback);

}  // namespace grapnel::hdf5
