#include "grapnel/plugin/guarded_call.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <utility>

namespace grapnel {
namespace {

// The working directory before a call of this thread, kept open between calls.
struct OpenDirectory {
  int descriptor = -1;
  dev_t device = 0;
  ino_t inode = 0;

  ~OpenDirectory() { close(); }
  bool is(const struct stat& status) const {
    return descriptor >= 0 && status.st_dev == device && status.st_ino == inode;
  }
  void open(const struct stat& status) {
    close();
    descriptor = ::open(".", O_PATH | O_DIRECTORY | O_CLOEXEC);
    device = status.st_dev, inode = status.st_ino;
  }
  void close() {
    if (descriptor >= 0) ::close(std::exchange(descriptor, -1));
  }
};
thread_local OpenDirectory t_directory;

}  // namespace

DirectoryGuard::DirectoryGuard() {
  struct stat now {};
  if (::stat(".", &now) == 0 && !t_directory.is(now)) t_directory.open(now);
}

DirectoryGuard::~DirectoryGuard() {
  struct stat now {};
  if (t_directory.descriptor < 0 || (::stat(".", &now) == 0 && t_directory.is(now))) return;
  [[maybe_unused]] const int changed = ::fchdir(t_directory.descriptor);
}

}  // namespace grapnel
