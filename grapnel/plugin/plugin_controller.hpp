#pragma once

/// @file
/// Controllers from shared libraries, by the C interface of grapnel_controller.h. A plugin runs in this process with
/// all rights of it: a scenario that names one is to be trusted as a program is.

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/plugin/grapnel_controller.h"
#include "grapnel/simulate/controller_source.hpp"

namespace grapnel {

/// A library that has been loaded and checked: it exports grapnel_controller(), of this version, with all functions
/// that must be there. Thread safety: any number of threads.
class ControllerPlugin {
 public:
  /// `shown`: what messages call it. @throws ControllerError.
  ControllerPlugin(const std::string& file, const std::string& shown);
  /// Of functions in this process, which must outlive it; `named`: what messages call it, "the plugin 'mine.so'".
  /// @throws ControllerError.
  ControllerPlugin(const grapnel_controller_plugin& functions, std::string named);
  ~ControllerPlugin();
  ControllerPlugin(const ControllerPlugin&) = delete;
  ControllerPlugin& operator=(const ControllerPlugin&) = delete;

  const std::string& named() const { return named_; }
  const grapnel_controller_plugin& functions() const { return *functions_; }

 private:
  std::string fault() const;  // why its functions are no controller; empty: they are

  std::string named_;
  void* library_ = nullptr;
  const grapnel_controller_plugin* functions_ = nullptr;
};

/// @throws ControllerError.
std::shared_ptr<const ControllerPlugin> open_plugin(const std::string& file, const std::string& shown);
/// Why a file is no plugin, in one sentence; empty: it is one. Its own code runs when it is loaded.
std::string plugin_fault(const std::string& file, const std::string& shown);

/// An instance of a plugin. A call that fails throws ControllerError with the plugin's name, the time and what the
/// plugin says; one that crashes ends the process (plugin_crash.hpp).
class PluginController final : public Controller {
 public:
  /// `parameters`: JSON. `model` has the robot's bodies; later ones may have more. @throws ControllerError.
  PluginController(std::shared_ptr<const ControllerPlugin> plugin, const ControlTiming& timing,
                   const std::string& parameters, ControlledRobot robot, const Model& model);
  ~PluginController() override;

  void begin_piece(const Model& model, double time) override;
  void update(const ControlInput& input, ControlCommand& command) override;

  /// What the instance remembers, and takes back. @throws ControllerError, also if the plugin does not know how.
  std::vector<unsigned char> save();
  void restore(const std::vector<unsigned char>& bytes);

 private:
  [[noreturn]] void fail(const char* what, double time) const;
  void gather(const ControlInput& input);
  void gather_readings(const ControlInput& input);

  std::shared_ptr<const ControllerPlugin> plugin_;
  ControlledRobot robot_;
  void* instance_ = nullptr;
  int piece_ = -1;
  double time_ = 0;
  int base_ = -1;                // body
  std::vector<int> joints_;      // positions in Model::joints()
  std::vector<int> velocities_;  // positions in State::v, in the order in which plugins see them
  std::vector<double> position_, rate_, desired_position_, desired_rate_, desired_acceleration_, effort_;
  std::vector<int> wheels_;  // velocities in State::v
  std::vector<double> wrench_, wheel_rate_, target_pose_, target_motion_;
};

}  // namespace grapnel
