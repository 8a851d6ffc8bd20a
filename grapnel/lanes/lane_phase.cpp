#include "grapnel/lanes/lane_phase.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "grapnel/integrate/stepper.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel::lanes {
namespace {

constexpr int kWidest = 8;

// Connects the stepper's callbacks to the caller's cases and outcomes.
class Exchange {
 public:
  Exchange(const LaneStructure& structure, const PhaseTables& tables, const LaneCaller& caller)
      : structure_(structure), tables_(tables), caller_(caller) {
    outcome_.q.resize(structure.coordinates);
    outcome_.v.resize(structure.velocities);
  }

  // Lane => record with pointers to the numbers of the next case, which stay valid until its end; false if the source
  // is empty. Throws std::invalid_argument if the case does not match the structure.
  bool next(int lane, CaseRecord& record) {
    LaneCase& next = cases_[lane];
    if (!caller_.source(next)) return false;
    check(next);
    record.start_time = next.motion->start_time;
    record.end_time = next.motion->end_time;
    record.max_step = next.max_step;
    record.links = next.links.data();
    record.q = next.q.data();
    record.v = next.v.data();
    record.intervals = next.motion->intervals.data();
    record.blocks = next.motion->blocks.data();
    errors_[lane] = nullptr;
    record.commands = next.commands.empty() ? nullptr : next.commands.data();
    const auto numbers = static_cast<std::size_t>(structure_.control.command_numbers());
    record.delayed_count = next.commands.empty() ? 0 : static_cast<int>(next.commands.size() / numbers) - 1;
    record.noise = next.noise.data();
    record.outside = next.outside.data();
    record.loops = next.loops.data();
    return true;
  }

  // Result of a lane => outcome of its case, passed to the sink: state, integrals, statistics, commands in delay and a
  // captured exception.
  void done(int lane, const CaseResult& r) {
    LaneOutcome& o = outcome_;
    o.id = cases_[lane].id;
    o.status = r.status;
    o.time = r.time;
    o.q.assign(r.q, r.q + structure_.coordinates);
    o.v.assign(r.v, r.v + structure_.velocities);
    numbers_.assign(r.integrals, r.integrals + tables_.integral_count);
    if (numbers_.size() < phase_integral::kWholeCount) numbers_.resize(phase_integral::kWholeCount);  // nothing outside
    o.integrals = phase_integrals(numbers_);
    o.steps = r.steps, o.rejected = r.rejected, o.evaluations = r.evaluations;
    o.next_step = r.next_step;
    o.quaternion_defect = r.quaternion_defect;
    o.loops = r.loops;
    o.trees.assign(r.trees, r.trees + tables_.tree_count);
    o.commands.clear();
    o.command_wheels = static_cast<std::size_t>(structure_.control.wheels);
    if (!structure_.control.by_case)
      o.commands.assign(r.commands, r.commands + structure_.control.command_numbers() * (1 + r.delayed_count));
    o.error = errors_[lane];
    caller_.sink(cases_[lane], o);
  }

  void observe(int lane, const CaseView& l) {
    see(view_, lane, l.time, l.q, l.v);
    view_.motor.assign(l.motor, l.motor + structure_.links.size());
    caller_.watch(view_);
  }

  // Case at the begin of an interval or at an edge => its command and the command's end. An exception of the control is
  // stored for the outcome; NaN then ends the case.
  double turn(int lane, const CaseTurn& t, double* command) {
    turn_.id = cases_[lane].id;
    turn_.is_first = t.is_first;
    turn_.time = t.time, turn_.end = t.end, turn_.phase_end = t.phase_end;
    turn_.q.assign(t.q, t.q + structure_.coordinates);
    turn_.v.assign(t.v, t.v + structure_.velocities);
    turn_.integrals.assign(t.integrals, t.integrals + tables_.integral_count);
    try {
      return caller_.control(turn_, {command, static_cast<std::size_t>(structure_.control.command_numbers())});
    } catch (...) {
      errors_[lane] = std::current_exception();
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  bool counts(int lane, double time, const double* q, const double* v) {
    see(end_of_step_, lane, time, q, v);
    return caller_.gate(end_of_step_);
  }

 private:
  void see(LaneView& view, int lane, double time, const double* q, const double* v) const {
    view.id = cases_[lane].id;
    view.time = time;
    view.q.assign(q, q + structure_.coordinates);
    view.v.assign(v, v + structure_.velocities);
  }

  // Case => nothing; throws std::invalid_argument if sizes, motion or commands do not match the structure, or the
  // maximum step is not positive.
  void check(const LaneCase& c) const {
    const auto size = [](int n) { return static_cast<std::size_t>(n); };
    if (c.links.size() != structure_.links.size() * size(kLinkNumbers) ||
        c.noise.size() != size(structure_.noise_numbers) || c.outside.size() != size(tables_.outside_numbers) ||
        c.loops.size() != structure_.loops.size() * size(kLoopNumbers) || c.q.size() != size(structure_.coordinates) ||
        c.v.size() != size(structure_.velocities)) {
      throw std::invalid_argument("run_lanes: a case's numbers do not match the structure");
    }
    if (!c.motion || c.motion->intervals.empty() || c.motion->intervals.back().end != c.motion->end_time ||
        !blocks_fit(*c.motion) || !(c.motion->end_time >= c.motion->start_time) || !std::isfinite(c.motion->end_time)) {
      throw std::invalid_argument("run_lanes: a case's motion does not match the structure, or ends before it starts");
    }
    if (!commands_fit(c)) throw std::invalid_argument("run_lanes: a case's commands do not match the structure");
    if (!(c.max_step > 0)) throw std::invalid_argument("run_lanes: a case's maximum step is not positive");
  }

  bool blocks_fit(const LaneMotion& motion) const {
    const auto numbers = static_cast<std::size_t>(structure_.block_size);
    for (const LaneInterval& interval : motion.intervals) {
      if (interval.block < 0 || numbers * (static_cast<std::size_t>(interval.block) + 1) > motion.blocks.size())
        return false;
    }
    return true;
  }

  // At most as many delayed commands as there is room for, and valid active ones.
  bool commands_fit(const LaneCase& c) const {
    const auto numbers = static_cast<std::size_t>(structure_.control.command_numbers());
    if (numbers == 0 || structure_.control.by_case) {
      const auto acts = [](const LaneInterval& i) { return i.due != 0 || i.samples; };
      return c.commands.empty() && std::none_of(c.motion->intervals.begin(), c.motion->intervals.end(), acts);
    }
    if (c.commands.empty() || c.commands.size() % numbers != 0) return false;
    const int most = structure_.control.max_delayed_count;
    int waiting = static_cast<int>(c.commands.size() / numbers) - 1;
    if (waiting > most) return false;
    for (const LaneInterval& i : c.motion->intervals) {
      waiting -= i.due;
      if (waiting < 0 || (i.samples && ++waiting > most)) return false;
      if (i.samples && i.acts_at_once) --waiting;
    }
    return true;
  }

  const LaneStructure& structure_;
  const PhaseTables& tables_;
  const LaneCaller& caller_;
  LaneCase cases_[kWidest];  // per lane
  LaneOutcome outcome_;
  std::vector<double> numbers_;  // of the integrals
  LaneView view_, end_of_step_;
  LaneTurn turn_;
  std::exception_ptr errors_[kWidest];  // exceptions that broke off the lane's case
};

// The trees of the links.
struct Trees {
  explicit Trees(const std::vector<LinkTable>& links) {
    for (const LinkTable& link : links) {
      of_link.push_back(link.parent < 0 ? count++ : of_link[link.parent]);
      if (has_one_axis(link.joint) && driven < 0) driven = of_link.back();
    }
  }
  std::vector<int> of_link;
  int count = 0;
  int driven = -1;  // the first with joints; none: -1
};

// Structure => tables for the kernel. The dimension of the error norm counts every integral that PhaseDynamics has, so
// that steps are the same. Throws std::invalid_argument for invalid tolerances.
PhaseTables tables_of(const LaneStructure& s, const Trees& trees) {
  const auto usable = [](double tolerance) { return tolerance > 0 && std::isfinite(tolerance); };
  if (!(s.integration.relative_tolerance >= 0) || !usable(s.integration.absolute_tolerance) ||
      s.integration.max_steps <= 0) {
    throw std::invalid_argument("run_lanes: tolerances and the limit on steps must be positive");
  }
  PhaseTables t{};
  t.links = s.links.data();
  t.link_count = static_cast<int>(s.links.size());
  t.tree_of = trees.of_link.data(), t.tree_count = trees.count, t.driven_tree = trees.driven;
  t.coordinates = s.coordinates;
  t.velocities = s.velocities;
  t.quaternions = s.quaternions.data();
  t.quaternion_count = static_cast<int>(s.quaternions.size());
  t.block_size = s.block_size;
  t.noise_numbers = s.noise_numbers;
  using namespace phase_integral;
  t.outside = s.outside;
  t.loads = s.loads.data();
  t.outside_numbers = s.outside_numbers();
  // PhaseDynamics integrates nine integrals of the whole. Where nothing acts from outside seven of them are zero and
  // not integrated here, but they count in the mean, so that steps are the same.
  const bool disturbed = s.outside.acts();
  const int integrals = kWholeCount + (disturbed ? kTreeCount * trees.count : 0);
  t.integral_count = disturbed ? integrals : kFrictionWork + 1;
  // Where springs have dampers PhaseDynamics integrates what these do in every tree.
  const bool has_dampers = std::any_of(s.links.begin(), s.links.end(), [](const LinkTable& l) { return l.has_damper; });
  t.dimension = s.coordinates - t.quaternion_count + s.velocities + integrals + (has_dampers ? trees.count : 0);
  t.recovers = s.recover_roots && !disturbed;
  t.loops = s.loops.data(), t.loop_count = static_cast<int>(s.loops.size());
  t.control = s.control;
  t.runaway = kRunaway;
  t.relative_tolerance = s.integration.relative_tolerance;
  t.absolute_tolerance = s.integration.absolute_tolerance;
  t.max_step = s.integration.max_step > 0 ? s.integration.max_step : std::numeric_limits<double>::infinity();
  t.max_steps = s.integration.max_steps;
  t.predictive = s.integration.predictive;
  return t;
}

using Unit = void (*)(const PhaseTables&, CaseExchange&);
// Instruction set => kernel compiled for it; one lane for sets that this build lacks.
Unit unit_of(InstructionSet set) {
  return of_set(set, []<class Set>(std::type_identity<Set>) -> Unit { return run_lane_phase_of<Set>; });
}

}  // namespace

// Outcome => one sentence with the cause and the time of the end of a case.
std::string explanation(const LaneOutcome& outcome) {
  switch (outcome.status) {
    case LaneStatus::step_too_small:
      return explain(StepStatus::step_too_small, outcome.time);
    case LaneStatus::too_many_steps:
      return explain(StepStatus::too_many_steps, outcome.time);
    case LaneStatus::non_finite:
      return explain(StepStatus::non_finite, outcome.time);
    case LaneStatus::unstable_control:
      return fmt::format("sampled control is unstable: at t = {:.9g} s a rate is beyond {:g} rad/s or m/s",
                         outcome.time, kRunaway);
    case LaneStatus::broken_off:
      return fmt::format("at t = {:.9g} s the case's control failed", outcome.time);
    case LaneStatus::step_refused:
      return fmt::format("at t = {:.9g} s the next step was rejected, and a single run must continue the case",
                         outcome.time);
    case LaneStatus::at_largest_rate:
      return fmt::format("at t = {:.9g} s a reaction wheel approaches its maximum rate, which lanes do not support",
                         outcome.time);
    case LaneStatus::loops_in_doubt:
      return fmt::format(
          "at t = {:.9g} s closed loops approach a configuration in which their rows change rank, or cannot be closed, "
          "which lanes do not support",
          outcome.time);
    case LaneStatus::finished:
      break;
  }
  return explain(StepStatus::finished, outcome.time);
}

// Structure and cases => outcomes, by the kernel of the instruction set, which calls back for each case through a table
// of functions. Throws std::invalid_argument if the set is not supported or the control is missing.
void run_lanes(const LaneStructure& structure, const LaneCaller& caller, InstructionSet set) {
  if (!is_supported(set)) {
    throw std::invalid_argument("run_lanes: " + std::string(name(set)) + " is not supported on this machine");
  }
  if (structure.control.by_case && !caller.control)
    throw std::invalid_argument("run_lanes: cases compute their own commands, but no control was given");
  const Trees trees(structure.links);
  const PhaseTables tables = tables_of(structure, trees);
  Exchange exchange(structure, tables, caller);
  CaseExchange calls{};
  calls.context = &exchange;
  calls.next = [](void* context, int lane, CaseRecord& record) {
    return static_cast<Exchange*>(context)->next(lane, record);
  };
  calls.done = [](void* context, int lane, const CaseResult& result) {
    static_cast<Exchange*>(context)->done(lane, result);
  };
  if (caller.watch) {
    calls.observe = [](void* context, int lane, const CaseView& view) {
      static_cast<Exchange*>(context)->observe(lane, view);
    };
  }
  calls.turn = [](void* context, int lane, const CaseTurn& turn, double* command) {
    return static_cast<Exchange*>(context)->turn(lane, turn, command);
  };
  if (caller.gate) {
    calls.counts = [](void* context, int lane, double time, const double* q, const double* v) {
      return static_cast<Exchange*>(context)->counts(lane, time, q, v);
    };
  }
  unit_of(set)(tables, calls);
}

}  // namespace grapnel::lanes
