#include "grapnel/fmi/unpacked_folder.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>

namespace grapnel::fmi {

UnpackedFolder::UnpackedFolder() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&files, ends[0], 0);
  // An inherited standard output would remain open and block its reader.
  ::posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_addopen(&files, 2, "/dev/null", O_WRONLY, 0);
  // A separate session: signals of the terminal do not reach the keeper.
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  std::string shell = "sh", option = "-c", script = "read x; exec rm -rf -- \"$0\"", folder = folder_.path().string();
  std::array<char*, 5> arguments{shell.data(), option.data(), script.data(), folder.data(), nullptr};
  pid_t keeper = -1;
  const int failed = ::posix_spawn(&keeper, "/bin/sh", &files, &attributes, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  ::posix_spawnattr_destroy(&attributes);
  ::close(ends[0]);
  if (failed == 0)
    keeper_ = keeper, alive_ = ends[1];
  else
    ::close(ends[1]);
}

UnpackedFolder::~UnpackedFolder() {
  if (keeper_ < 0) return;
  ::close(alive_);
  while (::waitpid(keeper_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

}  // namespace grapnel::fmi
