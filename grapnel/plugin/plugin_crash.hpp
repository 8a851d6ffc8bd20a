#pragma once

/// @file
/// Identifies the plugin that crashed or ended the process.

#include <string>

namespace grapnel {

/// While an object exists, this thread is inside a plugin's function. A hardware fault there (SIGSEGV, including stack
/// overflow, SIGBUS, SIGFPE, SIGILL, SIGABRT) or a call of exit() or quick_exit() prints a line on the standard error
/// that names the plugin, the function and the time. The process then ends with exit code 1, since its memory may be
/// damaged and further results would be unreliable. Files already written are kept. Faults elsewhere are handled as
/// without this class. Only plugin_supervisor.hpp detects _exit() and the death of the process.
class PluginCall {
 public:
  /// `plugin`: its name in messages, e.g. "the plugin 'mine.so'". The texts must outlive the object; `function` is a
  /// literal.
  PluginCall(const char* plugin, const char* function, double time);
  ~PluginCall();
  PluginCall(const PluginCall&) = delete;
  PluginCall& operator=(const PluginCall&) = delete;

  const char* const plugin;
  const char* const function;
  const double time;  // [s]

 private:
  const PluginCall* const outer_;
};

/// The plugin whose function was called last, in memory that a supervisor shares with the process (or in process
/// memory, without a supervisor).
struct PluginBlame {
  char plugin[256];      // empty: no plugin has been called
  const char* function;  // a literal
  double time;           // [s]
  int calls;             // in progress
  bool said;             // a line on the standard error has already named the plugin
};
/// Records calls in `blame`, and runs `first` before the first call.
void share_plugin_blame(PluginBlame* blame, void (*first)());
/// "the plugin 'mine.so' …" with the function and the time if a call is in progress.
std::string blame_text(const PluginBlame& blame, const std::string& what);

}  // namespace grapnel
