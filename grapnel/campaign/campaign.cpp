#include "grapnel/campaign/campaign.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <optional>

#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/lanes/lane_phase.hpp"
#include "grapnel/lanes/lane_phase_setup.hpp"
#include "grapnel/simulate/controller_source.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {

std::uint64_t Campaign::total() const {
  std::uint64_t points = 1;
  for (const StudyAxis& axis : design) points *= axis.values.size();
  return points * cases;
}

std::vector<std::size_t> Campaign::position(std::uint64_t point) const {
  std::vector<std::size_t> sizes;
  for (const StudyAxis& axis : design) sizes.push_back(axis.values.size());
  return grid_position(sizes, point);
}

CaseTooLong::CaseTooLong(double limit) : text(fmt::format("{} {:g} s", kTookTooLong, limit)) {}

void CaseClock::check() const {
  if (stop_.stop_requested()) throw CaseStopped{};
  if (limit_ <= 0) return;
  const std::chrono::duration<double> spent = spent_ + (Clock::now() - since_);
  if (spent.count() > limit_) throw CaseTooLong(limit_);
}

Block block_at(std::uint64_t number, std::uint64_t size, std::uint64_t total) {
  return {number, number * size, std::min(total, (number + 1) * size)};
}

std::uint64_t block_count(std::uint64_t size, std::uint64_t total) { return (total + size - 1) / size; }

bool is_success(const Campaign& campaign, const CaseRow& row) {
  if (row.status != CaseStatus::ok) return false;
  std::vector<double> numbers = row.values;
  numbers.insert(numbers.end(), row.inputs.begin(), row.inputs.end());
  return std::all_of(campaign.success.begin(), campaign.success.end(),
                     [&](const Criterion& criterion) { return criterion.holds(numbers); });
}

std::optional<CaseRow> run_campaign_case(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop) {
  std::vector<double> inputs(campaign.inputs.size(), NAN);
  const CaseClock clock(campaign, stop);
  CaseRow row;
  try {
    if (campaign.draw) inputs = campaign.draw(k);
    row = run_case(campaign.problem(k), campaign.mode, campaign.columns, clock.watch());
  } catch (const CaseStopped&) {
    return std::nullopt;
  } catch (const std::exception& error) {
    row = failed_case(error_text(error), campaign.columns.size());
  }
  row.index = k;
  row.inputs = std::move(inputs);
  row.success = is_success(campaign, row);
  return row;
}

BlockWork block_work(const Campaign& campaign) {
  if (const std::optional<lanes::InstructionSet> set = lanes::best_instruction_set()) {
    return [&campaign, set = *set](const Block& block, const std::stop_token& stop) {
      return run_block_in_lanes(campaign, block, set, stop);
    };
  }
  return [&campaign](const Block& block, const std::stop_token& stop) {
    std::vector<CaseRow> rows;
    for (std::uint64_t k = block.begin; k < block.end && !stop.stop_requested(); ++k) {
      std::optional<CaseRow> row = run_campaign_case(campaign, k, stop);
      if (!row) break;
      rows.push_back(std::move(*row));
    }
    return rows;
  };
}

namespace {

// Longer segments are not integrated in lanes, where one case would delay a whole block: they are integrated alone,
// from their start, under the time limit. The limit is a number of steps, not a time, so that it depends only on the
// case.
constexpr long kMostSteps = 50'000;

// Whether a margin that ends a segment may have reached zero within a step with known values at its ends: the rate of
// change is assumed to be at most twice the mean rate over this step or one of the two previous steps (docs/theory,
// section 6.5).
class MarginBound {
 public:
  /// The margin at the end of the next step, or at the start of the motion.
  bool may_fall(double t, double margin) {
    const double before = margin_, elapsed = t - time_;
    // A step that is rejected for another reason leaves no state to restore.
    if (elapsed <= 0 && std::isfinite(time_)) return true;
    const bool first = !(elapsed > 0);
    const double slope = first ? 0 : std::abs(margin - before) / elapsed;
    const double fastest = 2 * std::max({slope, slopes_[0], slopes_[1]});
    time_ = t, margin_ = margin;
    slopes_ = {slope, slopes_[0]};
    if (first) return !(margin > 0);
    return !(margin > 0 && 0.5 * (before + margin - fastest * elapsed) > 0);
  }

 private:
  double time_ = std::numeric_limits<double>::infinity(), margin_ = 0;
  std::array<double, 2> slopes_{0, 0};  // of the last two steps
};

// A case under computation.
struct ActiveCase {
  ActiveCase(const Campaign& campaign, const std::stop_token& stop) : clock(campaign, stop) {}

  CaseRow row;
  CaseClock clock;
  std::unique_ptr<StudyCase> point;     // steps refer to it
  std::unique_ptr<CaptureSteps> steps;  // null: the row is complete
  const MotionTask* task = nullptr;     // next task, in lanes
  std::optional<lanes::LaneStructure> structure;
  // Run in lanes that evaluate its controllers (lanes::take_turn); null: none.
  std::unique_ptr<PhaseDynamics> dynamics;
  std::exception_ptr error;  // thrown by a monitor of the current segment
  MarginBound margin;        // of its end condition

  /// Whether its task can share lanes with the given task.
  bool is_compatible(const lanes::LaneStructure& of, bool watched, bool may_stop) const {
    return !task->watch == !watched && !task->stop == !may_stop && *structure == of;
  }
};

// Passes a state to the monitors of a case's current segment. Their exceptions belong to the case and are stored
// until its lane has finished.
void show(const lanes::LaneView& view, ActiveCase& active, State& state, std::vector<double>& motor) {
  if (active.error) return;
  const Model& model = *active.task->model;
  state.q = view.q, state.v = view.v;
  motor.clear();
  for (int body : model.joints()) {
    motor.push_back(
        view.motor[static_cast<std::size_t>(model.bodies()[static_cast<std::size_t>(body)].placement.link)]);
  }
  active.clock.resume();
  try {
    active.task->watch(view.time, state, motor);
    active.clock.check();
  } catch (const CaseStopped&) {  // the block is abandoned
  } catch (const std::exception&) {
    active.error = std::current_exception();
  }
  active.clock.pause();
}

// Time attributed to one case.
class OnClock {
 public:
  explicit OnClock(CaseClock& clock) : clock_(clock) { clock_.resume(); }
  ~OnClock() { clock_.pause(); }
  OnClock(const OnClock&) = delete;
  OnClock& operator=(const OnClock&) = delete;

 private:
  CaseClock& clock_;
};

// Why a controller cannot continue. Rethrows all other exceptions.
std::string message_of(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const ControllerError& error) {
    return error.what();
  }
}

// Whether a case's current segment continues beyond a state, because its end condition is not met.
bool continues(const lanes::LaneView& view, ActiveCase& active, State& state) {
  if (!active.task->stop || active.error) return true;
  state.q = view.q, state.v = view.v;
  try {
    return !active.margin.may_fall(view.time, active.task->stop(view.time, state));
  } catch (const std::exception&) {
    active.error = std::current_exception();
  }
  return false;
}

Vector3d vector_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

GroupQuantities quantities_of(const lanes::LaneTree& tree) {
  return {vector_of(tree.com), {vector_of(tree.angular), vector_of(tree.linear)}, tree.size};
}

ClosureDefect closure_defect_of(const lanes::LaneLoopDefect& defect) {
  return {defect.position, defect.angle, defect.velocity, defect.angular_velocity};
}

PhaseMeasures measures_of(const lanes::LaneOutcome& outcome) {
  PhaseMeasures measures;
  for (const lanes::LaneTreeRecord& tree : outcome.trees) {
    measures.trees.push_back(
        {quantities_of(tree.start),
         tree.linear_deviation,
         tree.angular_deviation,
         tree.energy_deviation,
         {tree.linear_scale, tree.angular_scale, tree.energy_scale},
         {tree.exchanged[phase_integral::kExchangedImpulse], tree.exchanged[phase_integral::kExchangedMoment],
          tree.exchanged[phase_integral::kExchangedWork]},
         {tree.start.size.mass, tree.radius, tree.distance}});
    measures.scale.linear_momentum += tree.largest_linear;
    measures.scale.angular_momentum += tree.largest_angular;
    measures.scale.energy += tree.largest_energy;
  }
  measures.closures = closure_defect_of(outcome.loops.largest);
  return measures;
}

// See PhaseRun::outcome().
LoopOutcome loops_of(const lanes::LaneStructure& structure, const lanes::LaneOutcome& lane) {
  LoopOutcome loops;
  for (const lanes::LoopTable& table : structure.loops) loops.rows += table.forbidden();
  if (loops.rows == 0) return loops;
  const double relative = structure.integration.relative_tolerance;
  loops.rank = static_cast<int>(lane.loops.rank);
  loops.unprojected = closure_defect_of(lane.loops.unprojected);
  loops.correction_total = relative * lane.loops.corrections;
  loops.integration_error =
      relative * lane.loops.error_estimates + loop_limits::kRoundingOfStep * static_cast<double>(lane.steps + 1);
  return loops;
}

PhaseOutcome outcome_of(const lanes::LaneStructure& structure, const lanes::LaneOutcome& lane) {
  PhaseOutcome outcome;
  outcome.finished = lane.finished();
  if (!outcome.finished) outcome.failure = lanes::explanation(lane);
  outcome.end_time = lane.time;
  outcome.end_state.q = lane.q, outcome.end_state.v = lane.v;
  outcome.integrals = lane.integrals;
  outcome.rhs_evaluations = static_cast<long>(lane.evaluations);
  outcome.steps = static_cast<long>(lane.steps);
  outcome.rejected = static_cast<long>(lane.rejected);
  outcome.quaternion_defect = lane.quaternion_defect;
  outcome.loops = loops_of(structure, lane);
  return outcome;
}

class LaneBlock {
 public:
  LaneBlock(const Campaign& campaign, lanes::InstructionSet set, const std::stop_token& stop,
            std::size_t max_in_progress)
      : campaign_(campaign),
        detail_(detail_of(campaign.columns)),
        set_(set),
        stop_(stop),
        max_in_progress_(max_in_progress) {}

  std::vector<CaseRow> run(const Block& block) {
    next_ = block.begin, end_ = block.end;
    do {
      begin_some();
      integrate_all();
    } while (next_ < end_ && !stop_.stop_requested());
    if (stop_.stop_requested()) return {};  // cases may be incomplete: the block is abandoned
    std::vector<CaseRow> rows;
    for (auto& active : cases_) {
      active->row.success = is_success(campaign_, active->row);
      rows.push_back(std::move(active->row));
    }
    return rows;
  }

 private:
  // Runs a part of a case; an exception becomes the case's reason.
  template <class Work>
  void attempt(ActiveCase& active, Work&& work) {
    try {
      active.clock.resume();
      work();
    } catch (const CaseStopped&) {
      close(active);  // the block is abandoned
    } catch (const std::exception& error) {
      take(active, failed_case(error_text(error), campaign_.columns.size()));
    }
    active.clock.pause();
  }

  // Starts cases up to the limit. Returns whether any was started.
  bool begin_some() {
    const std::uint64_t first = next_;
    while (next_ < end_ && in_progress_ < max_in_progress_ && !stop_.stop_requested()) {
      cases_.push_back(std::make_unique<ActiveCase>(campaign_, stop_));
      ++in_progress_;
      begin(*cases_.back(), next_++);
    }
    return next_ > first;
  }

  void begin(ActiveCase& active, std::uint64_t k) {
    active.row.index = k;
    active.row.inputs.assign(campaign_.inputs.size(), NAN);
    attempt(active, [&] {
      active.row.inputs = campaign_.draw(k);
      active.point = std::make_unique<StudyCase>(campaign_.problem(k));
      const std::optional<ControlSetup>& control = active.point->problem.control;
      if (control && control->source && control->source->one_at_a_time()) return start_anew(active);
      const bool impact = campaign_.mode == StudyMode::impact;
      active.steps =
          std::make_unique<CaptureSteps>(active.point->problem, detail_, active.clock.watch(),
                                         impact ? CaptureSteps::Part::impact_only : CaptureSteps::Part::whole);
      advance(active);
    });
  }

  // Continues to the next segment for lanes, or to the end; other segments are integrated alone.
  void advance(ActiveCase& active) {
    while ((active.task = active.steps->next())) {
      const MotionTask& task = *active.task;
      if (!reason_alone(task).empty()) continue;
      IntegrationSetup integration = task.integration;
      integration.max_steps = std::min(integration.max_steps, kMostSteps);
      active.structure = lanes::lane_structure(*task.model, *task.setup, integration);
      // One step or more per sample time in all cases: their number does not characterize a case.
      if (active.structure->control.by_case) active.structure->integration.max_steps = task.integration.max_steps;
      return;
    }
    take(active, case_row(*active.point, active.steps->finish(), campaign_.columns));
  }

  // Alone, from the beginning: calls of controllers and sensors during a segment cannot be undone.
  void start_anew(ActiveCase& active) {
    active.steps.reset();
    take(active, run_case(*active.point, campaign_.mode, campaign_.columns, active.clock.watch()));
  }

  void take(ActiveCase& active, CaseRow row) {
    active.row.status = row.status;
    active.row.reason = std::move(row.reason);
    active.row.values = std::move(row.values);
    close(active);
  }
  void close(ActiveCase& active) {
    --in_progress_;
    active.task = nullptr;
    active.structure.reset();
    active.dynamics.reset();
    active.steps.reset();
    active.point.reset();
  }

  // Runs all active cases to their ends, segments of equal structure together.
  void integrate_all() {
    for (std::vector<ActiveCase*> waiting = waiting_from(0); !waiting.empty(); waiting = waiting_from(0)) {
      while (!waiting.empty()) {
        const std::vector<ActiveCase*> together = take_together(waiting);
        integrate(*together.front()->structure, together, true);
        if (stop_.stop_requested()) return;
      }
    }
  }

  std::vector<ActiveCase*> waiting_from(std::size_t first) const {
    std::vector<ActiveCase*> waiting;
    for (std::size_t i = first; i < cases_.size(); ++i) {
      if (cases_[i]->task) waiting.push_back(cases_[i].get());
    }
    return waiting;
  }

  // Extracts the cases that can share lanes with the first.
  static std::vector<ActiveCase*> take_together(std::vector<ActiveCase*>& waiting) {
    const ActiveCase& first = *waiting.front();
    const auto others = std::stable_partition(waiting.begin(), waiting.end(), [&](const ActiveCase* active) {
      return active->is_compatible(*first.structure, first.task->watch != nullptr, first.task->stop != nullptr);
    });
    const std::vector<ActiveCase*> together(waiting.begin(), others);
    waiting.erase(waiting.begin(), others);
    return together;
  }

  // Starts further cases if many slots are free, and runs them to a segment that can share lanes with `together`, which
  // they join. Returns whether any was started. With few free slots, because most cases wait for other lanes, the new
  // cases would not fill a lane block.
  bool begin_more(const lanes::LaneStructure& structure, bool watched, bool may_stop,
                  std::vector<ActiveCase*>& together) {
    const std::size_t begun = cases_.size();
    if (2 * in_progress_ > max_in_progress_ || !begin_some()) return false;
    for (;;) {
      std::vector<ActiveCase*> waiting = waiting_from(begun);
      const auto others = std::stable_partition(waiting.begin(), waiting.end(), [&](const ActiveCase* active) {
        return active->is_compatible(structure, watched, may_stop);
      });
      if (others == waiting.end()) {
        together.insert(together.end(), waiting.begin(), waiting.end());
        return true;
      }
      waiting.erase(waiting.begin(), others);
      const std::vector<ActiveCase*> first = take_together(waiting);
      integrate(*first.front()->structure, first, false);
      if (stop_.stop_requested()) return false;
    }
  }

  // Outcome of a case's segment in a lane => the case continues to its next segment, or integrates this one alone.
  void end_segment(const lanes::LaneStructure& structure, const lanes::LaneCase& lane,
                   const lanes::LaneOutcome& outcome, ActiveCase& active) {
    std::unique_ptr<PhaseDynamics> dynamics = std::move(active.dynamics);
    if (active.error) std::rethrow_exception(active.error);
    PhaseOutcome result = outcome_of(structure, outcome);
    const bool broken_off = outcome.status == lanes::LaneStatus::broken_off;
    if (broken_off) result.failure = message_of(outcome.error);
    const bool too_long = outcome.status == lanes::LaneStatus::too_many_steps &&
                          structure.integration.max_steps < active.task->integration.max_steps;
    // Integration alone resolves the remainder, and modes change at a wheel's largest rate.
    const bool continues_alone =
        outcome.status == lanes::LaneStatus::step_refused || outcome.status == lanes::LaneStatus::at_largest_rate;
    // Integration alone, from the start, reports the diverging quantity, or why loops cannot be closed.
    const bool for_alone = outcome.status == lanes::LaneStatus::unstable_control ||
                           (continues_alone && (dynamics || outcome.time == active.task->begin)) ||
                           (!continues_alone && !outcome.finished() && !broken_off && !structure.loops.empty());
    if (too_long || for_alone) {
      if (!dynamics) return advance(active);
      dynamics.reset();  // with its controller
      return start_anew(active);
    }
    const std::shared_ptr<ControlClock>& clock = active.task->setup->clock;
    if (dynamics) {
      dynamics->end_control(outcome.time);
    } else if (clock && (continues_alone || outcome.finished())) {
      lanes::end_control(*lane.motion, outcome, *clock);
    }
    if (continues_alone) {
      active.steps->integrated_in_part(std::move(result), measures_of(outcome), outcome.next_step);
    } else {
      active.steps->integrated(std::move(result), measures_of(outcome));
    }
    advance(active);
  }

  // Integrates one segment of each case, and with `refill` of further cases of the block that reach such a segment.
  // `structure` by value: the cases continue to other segments during the loop.
  void integrate(const lanes::LaneStructure structure, std::vector<ActiveCase*> together, bool refill) {
    const bool watched = together.front()->task->watch != nullptr;
    const bool may_stop = together.front()->task->stop != nullptr;
    std::size_t next = 0;
    const auto source = [&](lanes::LaneCase& lane) {
      while (refill && next == together.size() && begin_more(structure, watched, may_stop, together)) {
      }
      while (next < together.size() && !stop_.stop_requested()) {
        ActiveCase& active = *together[next++];
        bool ready = false;
        attempt(active, [&] {
          const MotionTask& task = *active.task;
          active.margin = {};
          lane.id = next - 1;
          lane.max_step = task.watch ? task.longest_look : std::numeric_limits<double>::infinity();
          lanes::lane_case(structure, *task.model, *task.setup, task.start,
                           lanes::lane_motion(structure, *task.model, *task.setup, task.begin, task.end), lane);
          if (structure.control.by_case) active.dynamics = std::make_unique<PhaseDynamics>(*task.model, *task.setup);
          ready = true;
        });
        if (ready) return true;
      }
      return false;
    };
    const auto sink = [&](const lanes::LaneCase& lane, const lanes::LaneOutcome& outcome) {
      ActiveCase& active = *together[outcome.id];
      attempt(active, [&] { end_segment(structure, lane, outcome, active); });
    };
    const auto control = [&](const lanes::LaneTurn& turn, std::span<double> command) {
      ActiveCase& active = *together[turn.id];
      const OnClock on_clock(active.clock);
      active.clock.check();
      return lanes::take_turn(structure, *active.dynamics, turn, command);
    };
    State state;
    std::vector<double> motor;
    const auto observe = [&](const lanes::LaneView& view) {
      if (!stop_.stop_requested()) show(view, *together[view.id], state, motor);
    };
    const auto gate = [&](const lanes::LaneView& view) { return continues(view, *together[view.id], state); };
    const lanes::LaneCaller caller{source, sink, watched ? lanes::LaneWatch(observe) : lanes::LaneWatch(),
                                   may_stop ? lanes::LaneGate(gate) : lanes::LaneGate(), control};
    lanes::run_lanes(structure, caller, set_for(together.size()));
  }

  // Empty lanes cost as much as full ones, and AVX2 gives the same bits as AVX-512.
  lanes::InstructionSet set_for(std::size_t cases) const {
    constexpr std::size_t kLanesOfAvx2 = 4;
    const bool is_too_wide = set_ == lanes::InstructionSet::avx512 && cases <= kLanesOfAvx2;
    return is_too_wide ? lanes::InstructionSet::avx2 : set_;
  }

  const Campaign& campaign_;
  const CaptureDetail detail_;
  const lanes::InstructionSet set_;
  const std::stop_token& stop_;
  const std::size_t max_in_progress_;               // largest number of concurrent cases
  std::vector<std::unique_ptr<ActiveCase>> cases_;  // begun, in the order of their cases
  std::size_t in_progress_ = 0;
  std::uint64_t next_ = 0, end_ = 0;  // cases to start
};

}  // namespace

std::string reason_alone(const MotionTask& task) {
  if (!task.only_here.empty()) return task.only_here;
  std::string reason = lanes::lane_obstacle(*task.model, *task.setup, task.integration, task.begin, task.end);
  // A case that leaves the lanes continues from its state, and evaluations at a sample time cannot be repeated.
  if (reason.empty() && task.stop && lanes::lane_structure(*task.model, *task.setup, task.integration).control.by_case)
    reason = "grasps close on arrival while sensors, controllers or thrusters are active";
  return reason;
}

std::vector<CaseRow> run_block_in_lanes(const Campaign& campaign, const Block& block, lanes::InstructionSet set,
                                        const std::stop_token& stop, std::size_t in_progress) {
  return LaneBlock(campaign, set, stop, in_progress).run(block);
}

}  // namespace grapnel
