#include "grapnel/scenario/read_approach.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/scenario/joint_values.hpp"
#include "grapnel/scenario/read_control.hpp"
#include "grapnel/scenario/read_motion_pieces.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// How well a stated motion must agree with what is also said elsewhere.
constexpr double kSameDuration = 1e-9;  // relative
constexpr double kSameStart = 1e-6;     // [rad or m; rad/s or m/s]

class ApproachReader {
 public:
  ApproachReader(const Node& node, Reading& reading)
      : node_(node), reading_(reading), robot_(reading.robot), faults_(reading.faults) {}

  ApproachSetup read(const TrajectoryFile* file) {
    read_members(node_, "approach", &approach_);
    read_tracking(part(node_, "tracking"));
    if (const Node* joints = node_.find("final_joints")) {
      approach_.final_position = positions_of(*joints, "approach.final_joints");
    }
    if (const NodeEntry* plan = node_.entry("plan")) read_plan(*plan);
    if (file) read_samples(*file);
    if (const Node* pieces = node_.find("pieces")) read_pieces(*pieces);
    if (const Node* rates = node_.find("final_rates")) {
      read_final_rates(*rates);
    } else if (approach_.plan && !node_.find("straight_in")) {
      approach_.match = RateMatch::twist;
    }
    if (const NodeEntry* straight = node_.entry("straight_in")) read_straight_in(*straight);
    read_waypoints(part(node_, "waypoints"));
    const bool is_free = robot_.setup.base_mode == RobotSetup::Base::free;
    approach_.base_control = base_control_at(node_, "approach", is_free, reading_);
    if (approach_.capture_at == ApproachSetup::CaptureAt::envelope) check_envelopes(part(node_, "capture_at").mark);
    return std::move(approach_);
  }

 private:
  // Values of all joints, within their limits.
  std::vector<double> positions_of(const Node& node, const std::string& path) {
    check_position_limits(node, path, robot_, faults_);
    return joint_values(node, path, robot_, {}, faults_).value_or(std::vector<double>{});
  }
  // Rates within the joints' limits; joints left out are at rest.
  std::optional<std::vector<double>> rates_of(const Node& node, const std::string& path) {
    check_rate_limits(node, path, robot_, faults_);
    return joint_values(node, path, robot_, 0.0, faults_);
  }

  void read_tracking(const Node& node) {
    TrackingSetup& tracking = approach_.tracking;
    if (tracking.mode != JointControl::prescribed) {
      read_gains(node, "approach.tracking", reading_, tracking.kp, tracking.kd);
    }
  }

  void read_plan(const NodeEntry& entry) {
    PlanSetup& plan = *approach_.plan;
    if (const Node* guess = entry.value.find("guess")) plan.guess = positions_of(*guess, "approach.plan.guess");
    if (!reading_.root.entry("grasps")) {
      faults_.add(entry.mark, "approach.plan needs 'grasps': there is nothing to reach");
    }
  }

  void read_samples(const TrajectoryFile& file) {
    std::optional<SampledMotion> motion = read_trajectory(file, robot_, faults_);
    if (!motion) return;
    end_at(motion->times.back(), "the trajectory ends");
    const auto first_of = [](const std::vector<std::vector<double>>& series) {
      std::vector<double> first;
      first.reserve(series.size());
      for (const std::vector<double>& one : series) first.push_back(one.front());
      return first;
    };
    begin_with(first_of(motion->positions), first_of(motion->rates), "the trajectory starts");
    approach_.sampled = std::move(*motion);
  }

  void read_pieces(const Node& list) {
    std::vector<MotionPiece> pieces = read_motion_pieces(list, robot_, faults_);
    if (pieces.empty()) return;
    end_at(pieces.back().until, "the pieces end");
    std::vector<double> position, rate;
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      const JointPoint first = evaluate(trajectory_of({pieces.data(), 1}, j), 0);
      position.push_back(first.position), rate.push_back(first.rate);
    }
    begin_with(position, rate, "the pieces start");
    approach_.pieces = std::move(pieces);
  }

  // The duration of a stated motion.
  void end_at(double end, std::string_view source) {
    if (node_.find("duration") && std::abs(approach_.duration - end) > kSameDuration * end) {
      faults_.add(part(node_, "duration").mark,
                  fmt::format("approach.duration is {} [s], but {} at {}; make them agree or leave out the duration",
                              approach_.duration, source, end));
    }
    approach_.duration = end;
  }

  // The initial joint values and rates of a stated motion; it may have left the rates to a spline.
  void begin_with(const std::vector<double>& position, const std::vector<double>& rate, const std::string& source) {
    const bool ideal = approach_.tracking.mode == JointControl::prescribed;
    const Node& initial = part(reading_.root, "initial");
    const Node *joints = initial.find("joints"), *rates = initial.find("joint_rates");
    if (joints) check_agreement(*joints, "initial.joints", robot_, position, kSameStart, source + " at", faults_);
    if (rates && ideal && rate.empty() && !robot_.joints.empty()) {
      faults_.add(initial.entry("joint_rates")->mark,
                  "initial.joint_rates: with ideal tracking the joints start with the trajectory's rates; leave out "
                  "joint_rates");
    } else if (rates && ideal) {
      check_agreement(*rates, "initial.joint_rates", robot_, rate, kSameStart, source + " with", faults_);
    }
    // Joints that follow exactly are on the stated motion from the start, to the last bit.
    if (!joints || ideal) reading_.problem.joint_position = position;
    if (!rates || ideal) reading_.problem.joint_rate = rate;
  }

  void read_final_rates(const Node& node) {
    const std::string path = "approach.final_rates";
    const NodeEntry* match = node.entry("match");
    if (!match) {
      for (const NodeEntry& entry : node.entries) {
        // A slip in this one key would otherwise read as the name of a joint.
        if (robot_.joint_names.contains(entry.key) || nearest(entry.key, {"match"}).empty()) continue;
        faults_.add(entry.mark, fmt::format("unknown key {} in {}; did you mean 'match'?", in_quotes(entry.key), path));
        return;
      }
      approach_.final_rates = rates_of(node, path);
      return;
    }
    const std::string value = text_at(node, "match");
    approach_.match = value == "twist"                  ? RateMatch::twist
                      : value == "velocity_least_rates" ? RateMatch::velocity_least_rates
                                                        : RateMatch::velocity;
    if (!reading_.root.entry("grasps")) {
      faults_.add(match->mark, path + ".match needs 'grasps': there is no motion to match");
    }
  }

  void read_straight_in(const NodeEntry& entry) {
    for (const GraspSetup& grasp : reading_.problem.grasps) {
      const GraspPoint* point = grasp_point_named(reading_, grasp.target, grasp.grasp_point);
      if (!point || point->approach_direction) continue;
      faults_.add(entry.mark,
                  fmt::format("approach.straight_in needs an 'approach_direction' at grasp point {} of target {}",
                              in_quotes(point->name), in_quotes(grasp.target)));
    }
  }

  void read_waypoints(const Node& list) {
    for (std::size_t i = 0; i < list.items.size() && !faults_.full(); ++i) {
      const Node& node = list.items[i];
      const std::string path = item("approach.waypoints", i);
      Waypoint waypoint;
      read_members(node, "approach.waypoints", &waypoint);
      if (const Node* joints = node.find("joints")) waypoint.joints = positions_of(*joints, below(path, "joints"));
      if (const Node* rates = node.find("rates")) waypoint.rates = rates_of(*rates, below(path, "rates"));
      for (const NodeEntry& place : part(node, "end_effectors").entries) {
        waypoint.places.push_back(read_place(place, below(path, "end_effectors")));
      }
      approach_.waypoints.push_back(std::move(waypoint));
    }
  }

  Waypoint::Place read_place(const NodeEntry& entry, const std::string& path) {
    Waypoint::Place place;
    place.end_effector = entry.key;
    robot_.end_effectors.expect(entry.key, entry.mark, path, faults_);
    const Node& node = entry.value;
    read_members(node, "approach.waypoints.end_effectors", &place);
    if (!place.target.empty()) {
      reading_.targets.expect(place.target, part(node, "target").mark, below(path, shortened(entry.key)), faults_);
    }
    return place;
  }

  void check_envelopes(const Mark& mark) {
    if (!reading_.root.entry("grasps")) {
      faults_.add(mark, "approach.capture_at: envelope needs 'grasps': there is nothing to close on");
    }
    const std::vector<GraspSetup>& grasps = reading_.problem.grasps;
    const auto waits = [](const GraspSetup& grasp) { return grasp.closes == GraspSetup::Closes::together; };
    if (!grasps.empty() && std::none_of(grasps.begin(), grasps.end(), waits)) {
      faults_.add(mark,
                  "approach.capture_at: envelope has nothing to wait for: every grasp has closes_at or "
                  "closes_on_arrival; leave out capture_at");
    }
    for (const GraspSetup& grasp : grasps) {
      const EndEffectorSetup* end_effector = end_effector_named(reading_, grasp.end_effector);
      if (!waits(grasp) || !end_effector || end_effector->envelope) continue;
      faults_.add(mark, fmt::format("approach.capture_at: envelope needs an 'envelope' at end-effector {}",
                                    in_quotes(end_effector->name)));
    }
  }

  const Node& node_;
  Reading& reading_;
  const ReadRobot& robot_;
  FaultList& faults_;
  ApproachSetup approach_;
};

}  // namespace

void read_approach(const Node& node, const TrajectoryFile* file, Reading& reading) {
  reading.problem.approach = ApproachReader(node, reading).read(file);
}

}  // namespace grapnel
