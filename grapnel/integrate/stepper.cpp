#include "grapnel/integrate/stepper.hpp"

#include <iomanip>
#include <sstream>

namespace grapnel {

// Status and time => one sentence for the user.
std::string explain(StepStatus status, double time) {
  std::ostringstream text;
  text << std::setprecision(17);
  switch (status) {
    case StepStatus::not_started:
      return "the integration has not been started";
    case StepStatus::running:
      text << "the integration has reached t = " << time;
      break;
    case StepStatus::finished:
      text << "the integration finished at t = " << time;
      break;
    case StepStatus::step_too_small:
      text << "the integration failed at t = " << time
           << ": the tolerances ask for a step below the resolution of time (a singularity, or tolerances too tight)";
      break;
    case StepStatus::too_many_steps:
      text << "the integration failed at t = " << time << ": the limit on the number of steps is used up";
      break;
    case StepStatus::non_finite:
      text << "the integration failed at t = " << time
           << ": the derivative is not finite there or just after, however short the step";
      break;
  }
  return text.str();
}

}  // namespace grapnel
