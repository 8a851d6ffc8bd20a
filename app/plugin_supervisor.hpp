#pragma once

/// @file
/// The program watched from outside while it runs plugins: one that calls _exit(), kills the process or crashes beyond
/// what its own handlers see (plugin/plugin_crash.hpp) must not pass for a success.

namespace grapnel::app {

/// From the first call into a plugin or an FMU on, the program continues in a child process, and this process waits for
/// it, passes signals on and ends as it ends, with exit code 1 and a line that names the plugin where a plugin ended
/// it. Nothing changes for programs that call none, or that have several threads by then. Once, first of all.
void supervise_plugins();

/// The program ends by its own decision with this code: called last of all.
int end_of_program(int code);

/// The same from a signal handler.
void note_end(int code);

}  // namespace grapnel::app
