#include "result/sample_result.hpp"

#include <sys/wait.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>

namespace grapnel::test {
namespace {

/// A number that no other field has, with a full mantissa.
double next() {
  static double value = 0;
  return std::sqrt(value += 1);
}
Vector3d next_vector() {
  const double x = next(), y = next(), z = next();
  return {x, y, z};
}

BodyMotion body(const std::string& name) {
  return {name, next_vector(), {0.5, -0.5, 0.5, -0.5}, next_vector(), next_vector()};
}

PhaseEnd phase_end(double time) {
  PhaseEnd end;
  end.time = time;
  end.base = body("base");
  end.joints = {{"left-1", "right-1"}, {next(), next()}, {next(), next()}};
  for (const char* side : {"left", "right"}) {
    EndEffectorMotion e{side, next_vector(), next_vector(), next_vector(), "debris", side + std::string("_handle")};
    e.miss_distance = next();
    e.relative_velocity = next_vector();
    e.relative_angular_velocity = next_vector();
    end.end_effectors.push_back(e);
  }
  end.end_effectors.push_back({"camera", next_vector(), next_vector(), next_vector(), "", ""});
  end.targets = {body("debris")};
  return end;
}

GraspImpulse grasp(const std::string& end_effector) {
  GraspImpulse g;
  g.end_effector = end_effector;
  g.target = "debris";
  g.grasp_point = end_effector + "_handle";
  g.model = "rigid";
  g.contact_point = next_vector();
  g.gap = next();
  g.gap_angle = next();
  g.target_displacement = next_vector();
  g.impulse = next_vector();
  g.angular_impulse = next_vector();
  g.impulse_magnitude = norm(g.impulse);
  g.mean_force = g.impulse_magnitude / 0.1;
  g.determined = {true, true, false, true, true, true};
  g.relative_velocity_before = next_vector();
  g.relative_angular_velocity_before = next_vector();
  return g;
}

// Parts added by control, measures and ratings.
void describe_law(ImpactReport& report) {
  ContactRebound rebound;
  rebound.normal = next_vector(), rebound.tangential_impulse = next_vector();
  rebound.modes = {"sliding", "sticking"};
  report.grasps[0].rebound = rebound;
  report.grasps[0].profile = ForceProfile{};
  report.hypothesis = "stronge";
  report.inconsistent = "grasp 1, linear y";
  report.held_joints = {{"left-1", 0.25, 0.5}};
  report.hard_contacts = {{"box", "floor", 4, 2.5, next_vector(), 0.125, 0.5, 0.25}};
  report.compliant = CompliantReport{};
  EndEffectorMeasure measure;
  measure.end_effector = "left";
  for (int i = 1; i <= 36; ++i) measure.inverse_inertia.push_back(i);
  report.measures = ImpactMeasures{};
  report.measures->end_effectors = {measure};
  report.measures->miss_of_robot_com = std::numeric_limits<double>::infinity();
  ImpactSensitivity sensitivity, undefined;
  sensitivity.parameter = undefined.parameter = "target mass";
  undefined.undefined = "the rank changes";
  report.sensitivities = {sensitivity, undefined};
  report.margins = {{"left-1", "force", 25, 100}};
  report.speed_limits = {{"left", 4, 0.25, "left-1", "force"}};
}

ImpactReport impact() {
  ImpactReport report;
  report.time = 20;
  report.duration = 0.1;
  report.grasps = {grasp("left"), grasp("right")};
  report.joints = {{"left-1", "left_link", next_vector(), next_vector(), next()},
                   {"right-1", "right_link", next_vector(), next_vector(), next()}};
  report.base_impulse = next_vector();
  report.base_angular_impulse = next_vector();
  report.rank = 11;
  report.rows = 12;
  report.null_space = {{{next_vector(), next_vector()}, {next_vector(), next_vector()}}};
  report.loops = {{"debris", {"left", "right"}, {"left_handle", "right_handle"}, 1.25, 1}};
  report.body_impulses = {{"base", next_vector(), next_vector()}, {"debris", next_vector(), next_vector()}};
  report.kinetic_energy_before = next();
  report.kinetic_energy_after = next();
  report.base_velocity_change = next_vector();
  report.base_angular_velocity_change = next_vector();
  report.joint_names = {"left-1", "right-1"};
  report.joint_velocity_change = {next(), next()};
  report.targets_before = {body("debris")};
  report.targets_after = {body("debris")};
  AsPublished published;
  published.grasps = {{"left", next_vector(), next_vector(), next()}, {"right", next_vector(), next_vector(), next()}};
  published.joint_velocity_after = {next(), next()};
  published.linear_momentum_error = next();
  published.angular_momentum_error = next();
  published.relative_linear_momentum_error = next();
  published.relative_angular_momentum_error = next();
  report.as_published = published;
  report.show_as_published = true;
  report.brake = BrakeReport{
      {"left-1", "right-1"}, {next(), next()}, next(), next(), {{"left", "debris", next_vector(), next_vector()}},
      next_vector(),         next_vector()};
  return report;
}

// The first holds for 25 s, the second misses.
std::vector<GraspOutcome> grasps() {
  std::vector<GraspOutcome> both(2);
  for (GraspOutcome& grasp : both) {
    grasp.target = "debris";
    grasp.judged = true;
    grasp.distance = next(), grasp.angle = next(), grasp.velocity = next(), grasp.angular_velocity = next();
  }
  both[0].end_effector = "left", both[0].grasp_point = "handle";
  both[0].captured = true, both[0].reason = "within the envelope";
  both[0].time = 20, both[0].released = 45;
  both[1].end_effector = "right", both[1].grasp_point = "rail";
  both[1].reason = "outside the envelope", both[1].limiting = "angle";
  both[1].time = 27;
  return both;
}

Series series(const std::string& path, const std::string& unit, const std::vector<std::string>& components,
              const std::vector<double>& time) {
  Series s{path, unit, "what " + path + " is", components, {}};
  for (const double t : time) {
    for (std::size_t i = 0; i < components.size(); ++i) s.data.push_back(std::sin(t + static_cast<double>(i)) * next());
  }
  return s;
}

}  // namespace

CaptureResult sample_result() {
  CaptureResult result;
  result.status = CaptureStatus::completed;
  result.scenario_name = "sample";
  result.scenario_sha256 = "0123456789abcdef";
  result.warnings = {"first", "second"};
  result.approach_start = phase_end(0);
  result.approach_end = phase_end(20);
  PlanReport plan;
  plan.joints = {"left-1", "right-1"};
  plan.final_position = {next(), next()};
  plan.final_rates = {next(), next()};
  plan.searched = plan.found = true;
  plan.objective = "excursion";
  plan.objective_value = next();
  plan.terms = {{"excursion", 1, plan.objective_value}};
  plan.distinct_solutions = 2;
  plan.miss = {{"left", next(), next(), next(), next()}, {"right", next(), next()}};
  plan.starts = 5, plan.solutions = 4, plan.iterations = 23;
  plan.rhs_evaluations = 1234;
  plan.smallest_singular_value = next();
  plan.straight_in = StraightInReport{15, 0.3, 0.02, next(), true, 16, 17, next(), 16.5, 1e-13, next()};
  result.plan = plan;
  result.capture_time = 20;
  result.grasps = grasps();
  result.clearance = {{0.25, "left_link", "debris", next_vector(), next_vector(), 12, "approach"},
                      {-0.05, "base", "debris", next_vector(), next_vector(), 33, "post_impact"}};
  result.clearance_events = {{"post_impact", 32, 34, 0, result.clearance[1], 32}};
  result.clearance_unwatched = {{"left_link", "debris"}};
  result.limit_events = {{LimitKind::rate, "left-1", "approach", 3, 4, -0.3, 3.5, -0.2}};
  result.first_violation = Violation{"rate", "rate of left-1 passes its limit -0.2", "approach", 3};
  result.valid_until = 32;
  result.impacts = {impact(), impact()};
  result.impacts[1].time = 27;
  result.impacts[1].rank = 12;
  result.impacts[1].null_space.clear();
  result.slips = {{43, "third", "debris", 10, 2, SlipEnd::lost, 44, 0.05, 0.25, 0.75}};
  result.losses = {{44, "third", "debris", 12.5, 2.5, 1.25, false}};
  result.releases = {{45, {"left", "right"}, {"debris", "debris"}}};
  result.loops = {
      {"post_impact", {"right - debris", "third - debris"}, 12, 9, next(), next(), next(), next(), next(), next()}};
  result.grasp_loads = {
      {"post_impact", "left", "debris", next(), next(), next(), next(), {true, true, true, true, true, true}},
      {"post_impact", "right", "debris", next(), next(), next(), next(), {true, false, true, true, true, true}}};
  result.post_impact_end = phase_end(70);
  result.ledger.entries = {
      {"linear_momentum_drift", 3.25e-15, 1e-11, "1", "largest over all phases", true},
      {"angular_momentum_drift", 2e-11, 1e-11, "1", "largest over all phases", true},
      {"loop_closure_position", 0, 1e-12, "m", "", false},
      {"clearance_violation", 0.05, 0, "m", "", true, LedgerEntry::Kind::feasibility},
  };
  result.ledger.scale = {12, 34, 56};
  result.cost = {{"approach", 2400, 200, 3}, {"post_impact", 350, 30, 0}};
  return result;
}

CaptureResult sample_result_with_laws() {
  CaptureResult result = sample_result();
  describe_law(result.impacts[0]);
  result.impacts[1] = result.impacts[0];
  result.impacts[1].time = 27;
  result.impacts[1].null_space.clear();
  return result;
}

TimeSeries sample_series(int samples) {
  TimeSeries result;
  for (int i = 0; i < samples; ++i) {
    result.time.push_back(0.1 * i);
    result.phase.push_back(i < samples / 2 ? 0 : 1);
  }
  result.phases = {"approach", "post_impact"};
  result.series = {
      series("base/position", "m", {"x", "y", "z"}, result.time),
      series("base/quaternion_wxyz", "1", {"w", "x", "y", "z"}, result.time),
      series("kinetic_energy", "J", {""}, result.time),
      series("joints/position", "rad", {"left-1", "right, \"1\""}, result.time),
      series("end_effectors/left-hand/velocity", "m/s", {"x", "y", "z"}, result.time),
      series("end_effectors/left_hand/velocity", "m/s", {"x", "y", "z"}, result.time),
      series("info/end", "N·m", {"only"}, result.time),
  };
  result.series[2].description = "½ νᵀ M ν";
  if (samples > 2) {
    result.series[0].data[0] = std::numeric_limits<double>::quiet_NaN();
    result.series[0].data[1] = std::numeric_limits<double>::infinity();
    result.series[0].data[2] = -std::numeric_limits<double>::infinity();
    result.series[0].data[3] = -0.0;
    result.series[0].data[4] = std::numeric_limits<double>::denorm_min();
  }
  return result;
}

TimeSeriesMetadata sample_metadata() { return {"0.1.0", "sample", "0123456789abcdef"}; }

bool same_numbers(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool equal = std::bit_cast<std::uint64_t>(a[i]) == std::bit_cast<std::uint64_t>(b[i]);
    if (!equal && !(std::isnan(a[i]) && std::isnan(b[i]))) return false;
  }
  return true;
}

int TemporaryFolder::files() const {
  return static_cast<int>(
      std::distance(std::filesystem::directory_iterator(path()), std::filesystem::directory_iterator()));
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void put_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

int run_python(const std::string& script, const std::string& arguments, std::string& output) {
  const std::string command = "/usr/bin/python3 " GRAPNEL_RESULT_TEST_DIR "/" + script + " " + arguments + " 2>&1";
  std::FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return -1;
  char buffer[4096];
  for (std::size_t n = 0; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) output.append(buffer, n);
  const int status = ::pclose(pipe);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace grapnel::test
