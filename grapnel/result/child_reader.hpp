#pragma once

/// @file
/// Reads a file in a child process, with a library that can crash or loop on a damaged or hostile file: failures of the
/// child become error messages in the parent. For .cpp files that read such files.

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace grapnel {

/// Whether a thread may start a child while other threads allocate memory. An allocator that another thread has locked
/// stays locked in the child: glibc prevents this, the address sanitizer of clang 14 does not, and the child would wait
/// forever.
#if defined(__SANITIZE_ADDRESS__)  // g++
inline constexpr bool kChildrenBesideThreads = false;
#elif defined(__has_feature)  // clang
inline constexpr bool kChildrenBesideThreads = !__has_feature(address_sanitizer);
#else
inline constexpr bool kChildrenBesideThreads = true;
#endif

/// No child process could be started; the state of the file is unknown.
struct NoProcess : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The child's end: sends numbers and texts to the parent. Writing ends the child if the parent has closed the pipe.
class ToParent {
 public:
  explicit ToParent(int descriptor) : descriptor_(descriptor) {}
  void put(const void* bytes, std::size_t size);
  void count(std::uint64_t value) { put(&value, sizeof value); }
  void text(const std::string& value);
  void texts(const std::vector<std::string>& values);
  template <class T>
  void numbers(const std::vector<T>& values) {
    static_assert(std::is_arithmetic_v<T>);
    count(values.size());
    put(values.data(), values.size() * sizeof(T));
  }
  void end(const std::string* fault);

 private:
  void flush();
  int descriptor_;
  std::string buffer_;
};

/// The parent's end. It does not trust sizes beyond the received bytes. Throws std::runtime_error with the child's
/// exception, or with the way in which the child ended.
class FromChild {
 public:
  FromChild(int descriptor, pid_t& child) : descriptor_(descriptor), child_(child) {}
  FromChild(const FromChild&) = delete;
  FromChild& operator=(const FromChild&) = delete;
  void get(void* bytes, std::size_t size);
  std::uint64_t count();
  std::string text();
  std::vector<std::string> texts();
  template <class T>
  std::vector<T> numbers() {
    static_assert(std::is_arithmetic_v<T>);
    constexpr std::uint64_t kAtOnce = (1 << 20) / sizeof(T);
    std::vector<T> values;
    for (std::uint64_t left = count(); left > 0;) {
      const std::uint64_t now = left < kAtOnce ? left : kAtOnce;
      const std::size_t before = values.size();
      values.resize(before + static_cast<std::size_t>(now));
      get(values.data() + before, static_cast<std::size_t>(now) * sizeof(T));
      left -= now;
    }
    return values;
  }
  /// Checks that no further data arrives and that the child ended without an error.
  void expect_end();

 private:
  bool fill();
  [[noreturn]] void died();
  void read(void* bytes, std::size_t size);
  int descriptor_;
  pid_t& child_;          // 0 once it is reaped
  std::size_t left_ = 0;  // of the current block
};

/// Generous limit of processor time for reading a file of this size.
inline double reading_seconds(double bytes) { return 4 + 2e-7 * bytes; }

/// Runs `work` in a child process and `take` in the caller, on the data of the child. The child has `seconds` of
/// processor time; it prints nothing and changes no state of the parent. `work` may use the state of the calling
/// thread, and must not wait for other threads, which do not exist in the child.
void read_in_child(double seconds, const std::function<void(ToParent&)>& work,
                   const std::function<void(FromChild&)>& take);

/// A child that opens a file once and answers questions about it until this object is destroyed. Thread safety: calls
/// are serialized.
class QueriedChild {
 public:
  using Answer = std::function<void(const std::string& question, ToParent&)>;
  /// `open` runs in the child and returns the function that answers; its exception is the reply to every question. Each
  /// answer, and the opening, has `seconds` of processor time. @throws std::runtime_error without a process
  QueriedChild(double seconds, const std::function<Answer()>& open);
  ~QueriedChild();
  QueriedChild(const QueriedChild&) = delete;
  QueriedChild& operator=(const QueriedChild&) = delete;

  /// Sends a question and runs `take` on the answer. After a failure all later questions fail with the same error.
  void query(const std::string& question, const std::function<void(FromChild&)>& take);

 private:
  void end();

  std::mutex mutex_;
  pid_t child_ = 0;
  int questions_ = -1, answers_ = -1;
  std::string failure_;
};

}  // namespace grapnel
