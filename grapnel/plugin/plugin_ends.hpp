#pragma once

/// @file
/// The end of a plugin's instances: when destroy() runs, and what becomes of its errors.

#include <functional>
#include <string>
#include <vector>

namespace grapnel {

/// While one lives, instances of plugins that its thread has finished with are not destroyed: what they computed can be
/// written first, since a plugin that crashes in destroy() ends the process. One thread's own.
class LatePluginEnds {
 public:
  LatePluginEnds();
  ~LatePluginEnds();
  LatePluginEnds(const LatePluginEnds&) = delete;
  LatePluginEnds& operator=(const LatePluginEnds&) = delete;

  /// Destroys them now.
  void finish();

 private:
  friend void end_plugin(std::function<void()> end);
  friend void end_late_plugins();
  std::vector<std::function<void()>> ends_;
  LatePluginEnds* const outer_;
};

/// Destroys those of this thread now: before another instance is made, which may need what they hold.
void end_late_plugins();

/// Runs `end`, at once or at the end of a LatePluginEnds. What it throws becomes a fault.
void end_plugin(std::function<void()> end);

/// Sentences on what went wrong when instances were destroyed, since the last call of this function, by any thread.
std::vector<std::string> take_plugin_faults();

}  // namespace grapnel
