#pragma once

/// @file
/// Controllers from shared libraries, by the C interface of grapnel_controller.h. A plugin runs in this process with
/// all its rights: treat a scenario that names a plugin like a program.

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/plugin/grapnel_controller.h"
#include "grapnel/simulate/controller_source.hpp"

namespace grapnel {

/// A loaded and checked library: it exports grapnel_controller(), in this version, with all mandatory functions. Thread
/// safety: any number of threads.
class ControllerPlugin {
 public:
  /// `shown`: the name in messages. @throws ControllerError.
  ControllerPlugin(const std::string& file, const std::string& shown);
  /// For functions in this process, which must outlive the object; `named`: the name in messages, e.g. "the plugin
  /// 'mine.so'". @throws ControllerError.
  ControllerPlugin(const grapnel_controller_plugin& functions, std::string named);
  ~ControllerPlugin();
  ControllerPlugin(const ControllerPlugin&) = delete;
  ControllerPlugin& operator=(const ControllerPlugin&) = delete;

  const std::string& named() const { return named_; }
  const grapnel_controller_plugin& functions() const { return *functions_; }

 private:
  std::string fault() const;  // why its functions are not a controller; empty: valid

  std::string named_;
  void* library_ = nullptr;
  const grapnel_controller_plugin* functions_ = nullptr;
};

/// @throws ControllerError.
std::shared_ptr<const ControllerPlugin> open_plugin(const std::string& file, const std::string& shown);
/// Why a file is not a plugin, in one sentence; empty: it is one. The library's initialization code runs when it is
/// loaded.
std::string plugin_fault(const std::string& file, const std::string& shown);

/// An instance of a plugin. A call that fails throws ControllerError with the plugin's name, the time and the plugin's
/// message; a crash ends the process (plugin_crash.hpp).
class PluginController final : public Controller {
 public:
  /// `parameters`: JSON. `model` contains the robot's bodies; later models may have more. @throws ControllerError.
  PluginController(std::shared_ptr<const ControllerPlugin> plugin, const ControlTiming& timing,
                   const std::string& parameters, ControlledRobot robot, const Model& model);
  ~PluginController() override;

  void begin_piece(const Model& model, double time) override;
  void update(const ControlInput& input, ControlCommand& command) override;

  /// Saves and restores the state of the instance. @throws ControllerError, also if the plugin does not support it.
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
  std::vector<int> velocities_;  // indices in State::v, in the order in which plugins see them
  std::vector<double> position_, rate_, desired_position_, desired_rate_, desired_acceleration_, effort_;
  std::vector<int> wheels_;  // indices in State::v
  std::vector<double> wrench_, wheel_rate_, target_pose_, target_motion_;
};

}  // namespace grapnel
