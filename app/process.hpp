#pragma once

/// @file
/// What a program settles with the system about itself.

namespace grapnel::app {

/// A file that grows beyond what is allowed (ulimit -f) is an error of writing, not the program's end; and where
/// stdin, stdout or stderr are closed, something that takes nothing is put in their place, so that no file that is
/// opened later gets their messages. Once, first of all.
void prepare_process();

/// How many threads work: as many as are asked for; 0: one per processor.
int threads_of(int asked);

}  // namespace grapnel::app
