#pragma once

/// @file
/// A second process that watches the program while it runs plugins. A plugin that calls _exit(), kills the process or
/// crashes beyond the reach of its handlers (plugin/plugin_crash.hpp) must not count as success.

namespace grapnel::app {

/// Enables supervision. At the first call into a plugin or an FMU the program continues in a child process. This
/// process waits for the child, forwards signals and ends with the child's status. If a plugin ended the child, it ends
/// with exit code 1 and a line that names the plugin. Programs that call no plugin, or that already have several
/// threads, are not affected. Call once, before anything else.
void supervise_plugins();

/// Ends the program with this code, as a regular end. The last call of the program.
int end_of_program(int code);

/// Records a regular end from a signal handler.
void note_end(int code);

}  // namespace grapnel::app
