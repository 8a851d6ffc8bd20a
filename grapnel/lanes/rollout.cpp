#include "grapnel/lanes/rollout.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

#include "grapnel/spatial/dispatch.hpp"

namespace grapnel::lanes {
namespace {

using RunRollout = void (*)(const RolloutTables&, const RolloutCases&);

// Instruction set => kernel compiled for it; one lane for sets that this build lacks.
RunRollout rollout_of(InstructionSet set) {
  return of_set(set, []<class Set>(std::type_identity<Set>) -> RunRollout { return run_lane_rollout_of<Set>; });
}

RolloutJoint driven(const Body& body, bool friction) {
  const JointDescription& joint = body.description.joint;
  const JointFriction& f = joint.friction;
  return {body.v,    joint.limits.effort, friction && f.viscous != 0, friction && f.coulomb != 0,
          f.viscous, f.coulomb,           1 / f.transition_rate};
}

void check_size(std::size_t found, std::int64_t cases, std::int64_t expected, bool may_be_absent, const char* what) {
  if (found == 0 && may_be_absent) return;
  if (static_cast<std::int64_t>(found) != cases * expected)
    throw std::invalid_argument("rollout: " + std::string(what) + " has " + std::to_string(found) + " numbers, " +
                                std::to_string(cases * expected) + " are expected");
}

// Stop token behind a RolloutCases context => whether a stop was requested.
bool is_stopped(void* context) { return static_cast<const std::stop_token*>(context)->stop_requested(); }

}  // namespace

// Model and setup => tables of links, driven joints and held roots, and the kernel of the best instruction set. Throws
// std::invalid_argument for an invalid step, number of substeps or held root, and for modal joints.
Rollout::Rollout(const Model& model, const RolloutSetup& setup) {
  if (!(setup.step > 0 && std::isfinite(setup.step)))
    throw std::invalid_argument("rollout: the step must be positive and finite");
  if (!model.tree().chains.empty())
    throw std::invalid_argument("rollout: the model has modal joints, which lanes do not support");
  if (setup.substeps < 1) throw std::invalid_argument("rollout: there must be at least one substep");
  for (const int body : model.joints()) joints_.push_back(driven(model.bodies()[body], setup.friction));
  for (const int root : setup.held) {
    const Body& body = model.bodies().at(root);
    if (body.parent >= 0 || !model.has_free_root(root))
      throw std::invalid_argument("rollout: only a free root can be held, and " + body.description.name + " is not");
    held_.resize(model.velocities());
    std::fill_n(held_.begin() + body.v, 6, std::uint8_t{1});
  }
  tables_.links = model.tree().links.data();
  tables_.link_count = static_cast<int>(model.tree().links.size());
  tables_.coordinates = model.coordinates();
  tables_.velocities = model.velocities();
  tables_.quaternions = model.quaternions().data();
  tables_.quaternion_count = static_cast<int>(model.quaternions().size());
  tables_.joints = joints_.data();
  tables_.controls = static_cast<int>(joints_.size());
  tables_.held = held_.empty() ? nullptr : held_.data();
  for (int k = 0; k < 3; ++k) tables_.gravity[k] = setup.gravity[k];
  tables_.step = setup.step;
  tables_.substeps = setup.substeps;
  tables_.is_euler = setup.method == RolloutMethod::euler;
  const InstructionSet set = best_instruction_set().value_or(InstructionSet::one_lane);
  run_ = rollout_of(set);
  width_ = lane_count(set);
}

// Initial states and controls => states, by threads that take batches of lanes as they become free; results do not
// depend on the number of threads. The last exception of a thread is rethrown.
void Rollout::run(const RolloutData& data, int threads, const std::stop_token& stop) const {
  if (data.cases < 0 || data.steps < 0) throw std::invalid_argument("rollout: negative number of cases or steps");
  check_size(data.initial.size(), data.cases, state_size(), false, "the initial states");
  check_size(data.control.size(), data.cases, data.steps * control_size(), true, "the control");
  check_size(data.states.size(), data.cases, data.steps * state_size(), true, "the output for states");
  check_size(data.last.size(), data.cases, state_size(), true, "the output for the last states");
  const auto pointer = [](auto span) { return span.empty() ? nullptr : span.data(); };
  RolloutCases all{pointer(data.initial),
                   pointer(data.control),
                   pointer(data.states),
                   pointer(data.last),
                   data.steps,
                   0,
                   data.cases,
                   nullptr,
                   nullptr};
  std::stop_token token = stop;
  if (stop.stop_possible()) all.stop = is_stopped, all.context = &token;
  // Threads take packs as they become free; several at a time for short cases, to reduce contention.
  constexpr std::int64_t kWorthAThread = 64;  // steps of a pack per batch
  const std::int64_t per_case = std::max<std::int64_t>(1, data.steps * tables_.substeps);
  const std::int64_t packs = (data.cases + width_ - 1) / width_;
  const std::int64_t at_once = std::clamp<std::int64_t>(kWorthAThread / per_case, 1, std::max<std::int64_t>(1, packs));
  std::atomic<std::int64_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;  // guarded by mutex
  const auto work = [&] {
    try {
      for (;;) {
        const std::int64_t pack = next.fetch_add(at_once);
        if (pack >= packs || stop.stop_requested()) return;
        RolloutCases mine = all;
        mine.begin = pack * width_;
        mine.end = std::min(data.cases, (pack + at_once) * width_);
        run_(tables_, mine);
      }
    } catch (...) {  // memory for the lanes
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
    }
  };
  const std::int64_t wanted = threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
  const std::int64_t count = std::min(wanted, (packs + at_once - 1) / at_once);
  {
    std::vector<std::jthread> others;
    try {
      for (std::int64_t i = 1; i < count; ++i) others.emplace_back(work);
    } catch (const std::system_error&) {
      // The system provides no more threads; the existing ones do the work.
    }
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace grapnel::lanes
