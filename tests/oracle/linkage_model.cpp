#include "oracle/linkage_model.hpp"

namespace grapnel::oracle {
namespace {

// A bar whose first pivot is at `pivot` of its parent; with `from_end` the origin is its other end.
BodyDescription body(const char* name, const char* parent, const Bar& bar, const Vector3d& pivot, double height,
                     double share = 1, bool from_end = false) {
  BodyDescription b;
  b.name = name, b.parent = parent;
  b.joint.name = std::string(name) + "_joint", b.joint.type = JointType::revolute;
  b.X_PF.p = pivot;
  b.mass = share * bar.mass;
  b.com = {bar.com_along - (from_end ? bar.length : 0), bar.com_across, height};
  // Only the moment about z has an effect in the plane.
  b.inertia = Symmetric3d::diagonal(0.7 * share * bar.inertia, 0.8 * share * bar.inertia, share * bar.inertia);
  return b;
}

BodyDescription base_body(const Bar& bar, bool floating, const Posed& X_WA) {
  BodyDescription b = body("base", "", bar, Vector3d::zero(), 0);
  b.joint.type = floating ? JointType::free : JointType::fixed;
  if (!floating) b.X_PF = X_WA;
  return b;
}

Posed at(double x) { return {Rotationd::identity(), {x, 0, 0}}; }

void set_joint(const Model& model, const char* name, double angle, double rate, State& state) {
  const Body& b = model.bodies()[model.body_index(name)];
  state.q[b.q] = angle, state.v[b.v] = rate;
}

bool is_cut(const Model& model) {
  for (const Body& b : model.bodies()) {
    if (b.description.name == "half") return true;
  }
  return false;
}

// The last bar `second` is connected to `first` at its far end, or to its own half on `first`.
Linkage close(const ModelBuilder& builder, LinkageCut cut, const char* first, double first_length, const char* second,
              double second_length) {
  Linkage l{builder.build(), {}};
  LoopClosure c;
  c.name = "loop";
  const int last = l.model.body_index(second);
  if (cut == LinkageCut::cut) {
    c.body_a = l.model.body_index("half"), c.X_AC = at(-second_length / 2);
    c.body_b = last, c.X_BD = at(second_length / 2), c.model = GraspModel::rigid;
  } else {
    c.body_a = l.model.body_index(first), c.X_AC = at(first_length);
    c.body_b = last, c.X_BD = at(second_length);
    c.model = cut == LinkageCut::pin_hinge ? GraspModel::hinge : GraspModel::point;
  }
  l.closures.push_back(c);
  return l;
}

}  // namespace

Linkage four_bar_model(const FourBar& bars, LinkageCut cut, bool floating, const Posed& X_WA, double thickness) {
  ModelBuilder builder;
  const double share = cut == LinkageCut::cut ? 0.5 : 1;
  builder.add(base_body(bars.base, floating, X_WA));
  builder.add(body("crank", "base", bars.crank, {0, 0, 0}, thickness));
  builder.add(body("coupler", "crank", bars.coupler, {bars.crank.length, 0, 0}, -thickness));
  builder.add(body("rocker", "base", bars.rocker, {bars.ground, 0, 0}, thickness, share));
  if (cut == LinkageCut::cut) {
    builder.add(body("half", "coupler", bars.rocker, {bars.coupler.length, 0, 0}, thickness, share, true));
  }
  return close(builder, cut, "coupler", bars.coupler.length, "rocker", bars.rocker.length);
}

void set_four_bar(const FourBar& bars, const Model& model, double f, double rate, State& state) {
  const FourBar::Angles g = bars.angles(f);
  set_joint(model, "crank", f, rate, state);
  set_joint(model, "coupler", g.coupler - f, (g.coupler1 - 1) * rate, state);
  set_joint(model, "rocker", g.rocker, g.rocker1 * rate, state);
  if (is_cut(model)) set_joint(model, "half", g.rocker - g.coupler, (g.rocker1 - g.coupler1) * rate, state);
}

Linkage five_bar_model(const FiveBar& bars, LinkageCut cut, const Posed& X_WA, double thickness) {
  ModelBuilder builder;
  const double share = cut == LinkageCut::cut ? 0.5 : 1;
  builder.add(base_body({0, 1, 1, 0, 0}, false, X_WA));
  builder.add(body("crank0", "base", bars.crank[0], {0, 0, 0}, thickness));
  builder.add(body("crank1", "base", bars.crank[1], {bars.ground, 0, 0}, -thickness));
  builder.add(body("coupler0", "crank0", bars.coupler[0], {bars.crank[0].length, 0, 0}, -thickness));
  builder.add(body("coupler1", "crank1", bars.coupler[1], {bars.crank[1].length, 0, 0}, thickness, share));
  if (cut == LinkageCut::cut) {
    builder.add(body("half", "coupler0", bars.coupler[1], {bars.coupler[0].length, 0, 0}, thickness, share, true));
  }
  return close(builder, cut, "coupler0", bars.coupler[0].length, "coupler1", bars.coupler[1].length);
}

void set_five_bar(const FiveBar& bars, const Model& model, const Vector2& x, const Vector2& rate, State& state) {
  const Vector2 y = bars.coupler_angles(x), yrate = bars.coupler_slopes(x, y) * rate;
  set_joint(model, "crank0", x[0], rate[0], state);
  set_joint(model, "crank1", x[1], rate[1], state);
  set_joint(model, "coupler0", y[0] - x[0], yrate[0] - rate[0], state);
  set_joint(model, "coupler1", y[1] - x[1], yrate[1] - rate[1], state);
  if (is_cut(model)) set_joint(model, "half", y[1] - y[0], yrate[1] - yrate[0], state);
}

double joint_angle(const Model& model, const State& state, const char* body) {
  return state.q[model.bodies()[model.body_index(body)].q];
}
double joint_value(const Model& model, const std::vector<double>& values, const char* body) {
  return values[model.bodies()[model.body_index(body)].v];
}

}  // namespace grapnel::oracle
