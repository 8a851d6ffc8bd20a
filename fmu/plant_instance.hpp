#pragma once

/// @file
/// An instance of an exported plant: the common implementation of both versions of FMI. The functions of the standards
/// in fmi2.cpp and fmi3.cpp only translate.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "grapnel/plant/plant_variables.hpp"

namespace grapnel::fmu {

/// Return values of functions, in both versions.
enum class Status : int { ok, warning, discard, error, fatal };

/// The state of an instance: the states of the standards' state machines for co-simulation that it distinguishes.
enum class Mode : unsigned { instantiated = 1, initialization = 2, stepping = 4, terminated = 8, failed = 16 };

/// A call that is not allowed or failed; what() is a sentence.
struct Refused : std::runtime_error {
  Refused(Status the_status, const std::string& why) : std::runtime_error(why), status(the_status) {}
  Status status;
};

/// Checks the arrays of a function that gets or sets `count` values. @throws Refused if one of them is null.
inline void check_arrays(const void* references, const void* values, std::size_t count) {
  if (count > 0 && (!references || !values))
    throw Refused(Status::error, "an array is a null pointer; value references and values are required");
}

/// Thread safety: one thread at a time; different instances are independent of each other.
class PlantInstance {
 public:
  using Log = std::function<void(Status status, const char* category, const std::string& message)>;

  /// Reads the package in a folder and checks the token. @throws std::exception with the reason.
  PlantInstance(const std::filesystem::path& resources, const std::string& token, Log log);
  ~PlantInstance();
  PlantInstance(const PlantInstance&) = delete;
  PlantInstance& operator=(const PlantInstance&) = delete;

  /// Runs a function of the standard, which is allowed in these modes. An error is logged with the function's name and
  /// becomes the returned status. After an error the instance is in the failed state; a refused call changes nothing.
  template <class Function>
  Status call(const char* name, std::initializer_list<Mode> allowed, const Function& function) {
    try {
      check_mode(allowed);
      function();
      return Status::ok;
    } catch (const Refused& refused) {
      return tell(name, refused.status, refused.what());
    } catch (const std::exception& error) {
      mode_ = Mode::failed;
      return tell(name, Status::error, error.what());
    } catch (...) {
      mode_ = Mode::failed;
      return tell(name, Status::error, "an exception of unknown type");
    }
  }
  /// For functions that this plant does not support.
  Status refuse(const char* name, const std::string& why) const { return tell(name, Status::error, why); }

  void set(PlantVariable::Type type, unsigned reference, double value);
  double get(PlantVariable::Type type, unsigned reference);

  void set_start(double start);
  bool has_start() const { return has_start_; }
  void enter_initialization();
  void exit_initialization();
  /// Advances from `time` by `size`. Returns whether the run has ended. A step that is not a multiple of the period is
  /// refused with the status `no_multiple` and changes nothing.
  bool step(double time, double size, Status no_multiple);
  void terminate();
  void reset();

  double time() const;
  bool has_ended() const;

 private:
  void check_mode(std::initializer_list<Mode> allowed) const;
  Status tell(const char* name, Status status, const std::string& why) const;
  const PlantVariable& variable_at(PlantVariable::Type type, unsigned reference) const;
  void need_run();
  void take_outputs();

  struct Parts;  // the package, and the run
  const std::unique_ptr<Parts> parts_;
  const Log log_;
  PlantVariables variables_;
  Mode mode_ = Mode::instantiated;
  std::vector<double> values_;  // of all variables
  double start_ = 0;            // start of the scenario's clock, in the master's time [s]
  bool has_start_ = false;
  double last_time_ = 0;  // of the scenario's clock
};

/// The path that a resource location names: a URI of a file on this machine, or a path. @throws std::runtime_error.
std::filesystem::path resources_path(const char* location);

}  // namespace grapnel::fmu
