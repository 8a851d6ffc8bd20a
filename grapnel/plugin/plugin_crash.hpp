#pragma once

/// @file
/// Who is to blame when a plugin crashes or ends the process.

#include <string>

namespace grapnel {

/// While one lives, this thread is inside a plugin's function. A fault of the machine there (SIGSEGV, also by an
/// overflow of the stack, SIGBUS, SIGFPE, SIGILL, SIGABRT) and a call of exit() or quick_exit() write a line to the
/// standard error that names the plugin, the function and the time, and end the process with exit code 1: memory may be
/// damaged, and what would be computed from it could not be trusted. Files that have been written stay. A fault
/// elsewhere goes where it would without this. _exit() and the death of the process are seen by plugin_supervisor.hpp
/// alone.
class PluginCall {
 public:
  /// `plugin`: what it is called, "the plugin 'mine.so'". The texts must outlive it; `function` is a literal.
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

/// The plugin whose function was called last, in memory that a supervisor shares with the process (or of this process
/// alone, without one).
struct PluginBlame {
  char plugin[256];      // empty: none has been called
  const char* function;  // a literal
  double time;           // [s]
  int calls;             // under way
  bool said;             // a line on the standard error has named the plugin
};
/// Makes calls known at `blame`, and runs `first` before the first call of all.
void share_plugin_blame(PluginBlame* blame, void (*first)());
/// "the plugin 'mine.so' …" with the function and the time if a call is under way.
std::string blame_text(const PluginBlame& blame, const std::string& what);

}  // namespace grapnel
