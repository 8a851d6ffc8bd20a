#pragma once

/// @file
/// The end of a plugin's instances: the time of destroy(), and its errors.

#include <functional>
#include <string>
#include <vector>

namespace grapnel {

/// While an object exists, finished plugin instances of its thread are not destroyed. Their results can be written
/// first, since a plugin that crashes in destroy() ends the process. Belongs to one thread.
class LatePluginEnds {
 public:
  LatePluginEnds();
  ~LatePluginEnds();
  LatePluginEnds(const LatePluginEnds&) = delete;
  LatePluginEnds& operator=(const LatePluginEnds&) = delete;

  /// Destroys the instances now.
  void finish();

 private:
  friend void end_plugin(std::function<void()> end);
  friend void end_late_plugins();
  std::vector<std::function<void()>> ends_;
  LatePluginEnds* const outer_;
};

/// Destroys the finished instances of this thread now: before another instance is created, which may need their
/// resources.
void end_late_plugins();

/// Runs `end`, immediately or at the end of a LatePluginEnds. Its exceptions are recorded as errors.
void end_plugin(std::function<void()> end);

/// The errors that occurred when instances were destroyed, as sentences, by any thread since the last call.
std::vector<std::string> take_plugin_faults();

}  // namespace grapnel
