#pragma once

/// @file
/// Who is to blame when a plugin crashes.

namespace grapnel {

/// While one lives, this thread is inside a plugin's function. A fault of the machine there (SIGSEGV, SIGBUS, SIGFPE,
/// SIGILL, SIGABRT) writes a line to the standard error that names the plugin, the function and the time, and ends the
/// process with exit code 1: memory may be damaged, and what would be computed from it could not be trusted. Files that
/// have been written stay. A fault elsewhere goes where it would without this. An overflow of the stack cannot be
/// reported.
class PluginCall {
 public:
  /// `plugin`: what it is called, "the plugin 'mine.so'". The texts must outlive it.
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

}  // namespace grapnel
