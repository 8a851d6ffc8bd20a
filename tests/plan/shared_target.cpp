#include "plan/shared_target.hpp"

#include <cmath>

#include "grapnel/plan/shooting.hpp"

namespace grapnel::testing {
namespace {

constexpr double kHalfTurn = 3.14159265358979323846;

// Planar: z is a principal axis, so that motion about z stays in the plane.
BodyDescription body(const std::string& name, const std::string& parent, double mass, double size, bool planar,
                     Random& random) {
  BodyDescription b;
  b.name = b.joint.name = name;
  b.parent = parent;
  b.mass = mass;
  b.inertia = random_inertia(mass, size, random);
  if (planar) b.inertia.xz = b.inertia.yz = 0;
  return b;
}

// A chain of links along x of their frames, from `parent`; joint axes z, or alternately y and x. An end-effector at its
// end.
void add_arm(ModelBuilder& builder, const std::string& prefix, const std::string& parent, const Posed& mount,
             bool planar, Random& random) {
  const int joints = planar ? random.integer(3, 4) : random.integer(6, 7);
  std::string last = parent;
  Posed X_PF = mount;
  double length = 0;
  for (int j = 0; j < joints; ++j) {
    BodyDescription b =
        body(prefix + "-link-" + std::to_string(j + 1), last, random.log_uniform(3, 20), 0.3, planar, random);
    b.joint.type = JointType::revolute;
    b.joint.axis = planar       ? Vector3d{0, 0, 1}
                   : j % 2 == 1 ? Vector3d{0, 1, 0}
                   : j % 4 == 0 ? Vector3d{0, 0, 1}
                                : Vector3d{1, 0, 0};
    b.X_PF = X_PF;
    length = random.uniform(planar ? 0.6 : 0.2, planar ? 1.1 : 0.7);
    b.com = {0.5 * length, 0, 0};
    builder.add(b);
    last = b.name;
    X_PF = {Rotationd::identity(), {length, 0, planar ? 0 : random.uniform(-0.1, 0.1)}};
  }
  builder.add(FrameDescription{"hand-" + prefix, last, {Rotationd::identity(), {length, 0, 0}}});
}

// Rates that bring the end-effectors to a target moving with V at `goals`; the goals are set to the resulting
// end-effector positions.
bool settle_goals(FloatingBase& base, const Twistd& V_WO, const std::vector<double>& position, ReachProblem& p) {
  std::vector<double> rate(position.size(), 0.0);
  PathSegment segment(base, p.start, p.motion);
  for (int i = 0; i < 12; ++i) {
    const SegmentEnd end = segment.fly(position, rate, false);
    if (!end.finished) return false;
    base.place(position);
    for (Goal& g : p.goals) {
      g.X_WG = end.X_WB * base.frame_pose(g.frame);
      g.V_WG = shift(V_WO, g.X_WG.p);
      g.direction_W = g.X_WG.R * g.axis_E;
    }
    const ShootingIterate shot = Shooting(base, p).shoot(position, rate);
    if (!shot.valid) return false;
    for (double r : shot.rate) {
      if (std::abs(r) > 1) return false;  // close to a singularity: skipped
    }
    if (shot.error.norm() < 1e-8) return true;  // within the tolerance of a solution
    rate = shot.rate;
  }
  return false;
}

}  // namespace

Servicer random_servicer_with(const ManyArms& kind, int index) {
  Random random(index);
  ModelBuilder builder;
  BodyDescription base = body("base", "", random.log_uniform(100, 2000), 1.5, kind.planar, random);
  base.joint.type = JointType::free;
  base.com = kind.planar ? Vector3d{random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 0} : random.vector(0.3);
  builder.add(base);
  std::string trunk = "base";
  if (kind.torso) {
    BodyDescription torso = body("torso", "base", 40, 0.5, kind.planar, random);
    torso.joint.type = JointType::revolute;
    torso.joint.axis = {0, 0, 1};
    builder.add(torso);
    trunk = "torso";
  }
  for (int a = 0; a < kind.arms; ++a) {
    // Around the base, pointing away from it.
    const double angle = 2 * kHalfTurn * a / kind.arms + random.uniform(-0.3, 0.3);
    const Vector3d place{0.7 * std::cos(angle), 0.7 * std::sin(angle), kind.planar ? 0 : random.uniform(-0.2, 0.2)};
    const Rotationd R = rotation_about({0, 0, 1}, angle);
    add_arm(builder, std::to_string(a + 1), trunk,
            {kind.planar ? R : R * rotation_about({0, 1, 0}, random.uniform(-0.5, 0.5)), place}, kind.planar, random);
  }
  Servicer s{builder.build(), {}};
  s.state = zero_state(s.model);
  for (int b : s.model.joints()) s.state.q[s.model.bodies()[b].q] = random.uniform(-1.2, 1.2);
  Twistd V{random.vector(0.02), random.vector(0.02)};
  if (kind.planar) V.angular[0] = V.angular[1] = V.linear[2] = 0;
  set_root_twist(s.model, s.model.body_index("base"), V, s.state);
  return s;
}

SharedTarget random_shared_target(const ManyArms& kind, Goal::Orientation orientation, RateDemand demand, double turn,
                                  int index) {
  for (int trial = 0;; ++trial) {
    const int stream = 1000 * (index + 1) + trial;
    SharedTarget t{random_servicer_with(kind, stream), {}, {}};
    Random random(stream + 500'000);
    ReachProblem& p = t.problem;
    p = reach_problem(t.servicer, 20, index % 2 ? JointProfile::quintic : JointProfile::quartic, {0, 0, 0});
    if (p.start.profile == JointProfile::quartic) p.start.rate.assign(p.start.rate.size(), 0.0);
    p.demand = demand;
    for (int a = 1; a <= kind.arms; ++a) {
      Goal g;
      g.name = "hand-" + std::to_string(a);
      g.frame = t.servicer.model.frame_index(g.name);
      g.target = "target", g.point = "point-" + std::to_string(a);
      g.orientation = orientation;
      g.axis_E = kind.planar ? Vector3d{1, 0, 0} : random.direction();
      p.goals.push_back(g);
    }
    t.reached = p.start.position;
    for (double& x : t.reached) x += random.uniform(-turn, turn);
    Twistd V_WO{random.vector(0.1), random.vector(0.05)};
    if (kind.planar) V_WO.angular[0] = V_WO.angular[1] = V_WO.linear[2] = 0;
    FloatingBase base(t.servicer.model, true);
    if (settle_goals(base, V_WO, t.reached, p)) return t;
  }
}

}  // namespace grapnel::testing
