#pragma once

/// @file
/// A computation that stops where it needs something done, and goes on once that has been done: a coroutine whose
/// `co_await` hands out what is needed.

#include <coroutine>
#include <exception>
#include <utility>

namespace grapnel {

/// Return type of such a coroutine. Its body does nothing before the first next(). What it awaits are objects that
/// derive from Resumable<Needed>::Stop, named variables of the body; the value of the `co_await` expression is what
/// their await_resume() returns.
///
///     Resumable<Question> computation() { Question question(...); const int answer = co_await question; ... }
///
///     Resumable<Question> running = computation();
///     while (Question* question = running.next()) question->answer = ...;
///
/// The coroutine frame, with everything alive in it, is freed by the destructor, wherever the body has got to.
/// Arguments of the coroutine should be references to what outlives it.
template <class Needed>
class Resumable {
 public:
  struct promise_type {
    Needed* needed = nullptr;
    std::exception_ptr error = {};

    Resumable get_return_object() { return Resumable(std::coroutine_handle<promise_type>::from_promise(*this)); }
    std::suspend_always initial_suspend() noexcept { return {}; }
    std::suspend_always final_suspend() noexcept { return {}; }
    void return_void() noexcept {}
    void unhandled_exception() noexcept { error = std::current_exception(); }
  };

  /// Base of what can be awaited: `class Needed : public Resumable<Needed>::Stop`, with an await_resume().
  class Stop {
   public:
    bool await_ready() const noexcept { return false; }
    void await_suspend(std::coroutine_handle<promise_type> body) noexcept {
      body.promise().needed = static_cast<Needed*>(this);
    }

   protected:
    Stop() = default;
    ~Stop() = default;
  };

  Resumable(Resumable&& other) noexcept : body_(std::exchange(other.body_, nullptr)) {}
  Resumable& operator=(Resumable&&) = delete;
  ~Resumable() {
    if (body_) body_.destroy();
  }

  /// Runs the body to its next `co_await`; what it awaits there is valid until the next call. Null: the body has ended.
  /// An exception that leaves the body ends it and is thrown here.
  Needed* next() {
    if (body_.done()) return nullptr;
    body_.promise().needed = nullptr;
    body_.resume();
    if (std::exception_ptr error = std::exchange(body_.promise().error, nullptr)) std::rethrow_exception(error);
    return body_.done() ? nullptr : body_.promise().needed;
  }
  bool done() const { return body_.done(); }

 private:
  explicit Resumable(std::coroutine_handle<promise_type> body) : body_(body) {}
  std::coroutine_handle<promise_type> body_;
};

}  // namespace grapnel
