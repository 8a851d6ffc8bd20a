#include "grapnel/campaign/case_clock.hpp"

#include <fmt/format.h>

namespace grapnel {

CaseTooLong::CaseTooLong(double limit) : text(fmt::format("{} {:g} s", kTookTooLong, limit)) {}

void CaseClock::check() const {
  if (stop_.stop_requested()) throw CaseStopped{};
  if (limit_ <= 0) return;
  const std::chrono::duration<double> spent = spent_ + (Clock::now() - since_);
  if (spent.count() > limit_) throw CaseTooLong(limit_);
}

}  // namespace grapnel
