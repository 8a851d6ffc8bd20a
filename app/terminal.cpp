#include "terminal.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <mutex>

#include "grapnel/text/message_text.hpp"

namespace grapnel::app {
namespace {

std::mutex mutex;
bool progress_shown = false;  // a line without an end stands on the terminal; guarded by mutex

// Longer lines of stderr are cut: a list in a message may have any length.
constexpr std::size_t kLongestLine = 16384;  // [bytes]

std::string with_short_lines(std::string text) {
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = std::min(text.find('\n', begin), text.size());
    if (end - begin > kLongestLine) {
      std::size_t last = begin + kLongestLine;
      while (last > begin && (static_cast<unsigned char>(text[last]) & 0xc0) == 0x80) --last;
      text.replace(last, end - last, "…");
      end = text.find('\n', last) == std::string::npos ? text.size() : text.find('\n', last);
    }
    begin = end + 1;
  }
  return text;
}

// With `mutex` held. What could not be written shows in ferror(stdout); of stderr nobody asks.
void put(std::FILE* stream, const std::string& text) { (void)!std::fwrite(text.data(), 1, text.size(), stream); }

void erase_line() {
  if (progress_shown) put(stderr, "\r\033[K");
  progress_shown = false;
}

}  // namespace

bool stderr_is_terminal() { return isatty(STDERR_FILENO) == 1; }

void write_stdout(std::string_view lines) {
  const std::lock_guard lock(mutex);
  erase_line();
  put(stdout, printable_lines(lines));
}

void write_stderr(std::string_view lines) {
  const std::lock_guard lock(mutex);
  erase_line();
  // The buffer of stdout is written wherever it is full: without this a line of stderr would stand within one of it.
  std::fflush(stdout);
  put(stderr, with_short_lines(printable_lines(lines)));
  std::fflush(stderr);
}

void flush_stdout() {
  const std::lock_guard lock(mutex);
  std::fflush(stdout);
}

void show_progress(std::string_view line) {
  const std::lock_guard lock(mutex);
  const bool terminal = stderr_is_terminal();
  std::fflush(stdout);
  put(stderr, terminal ? "\r\033[K" + printable_line(line) : printable_line(line) + "\n");
  std::fflush(stderr);
  progress_shown = terminal;
}

void erase_progress() {
  const std::lock_guard lock(mutex);
  erase_line();
  std::fflush(stderr);
}

void say_faults(const std::vector<Fault>& faults) {
  std::string lines;
  for (const Fault& fault : faults) lines += fault.text() + "\n";
  write_stderr(lines);
}

}  // namespace grapnel::app
