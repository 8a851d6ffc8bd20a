/// The gravity field near a reference orbit against closed forms, separate two-body integrations, and symmetries.

#include "grapnel/simulate/orbit.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "grapnel/simulate/magnetic_field.hpp"
#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace orbit_test {

constexpr double kMu = 3.986004418e14;
const IntegrationSetup kTight = [] {
  IntegrationSetup tight;
  tight.relative_tolerance = 1e-13, tight.absolute_tolerance = 1e-15;
  return tight;
}();

// 400 km above the Earth, with axes rotated relative to W.
ReferenceOrbit low_orbit(double eccentricity = 0, double true_anomaly = 0) {
  ReferenceOrbit orbit;
  orbit.mu = kMu;
  orbit.semi_major_axis = 6.778137e6 / (1 - eccentricity);
  orbit.eccentricity = eccentricity, orbit.true_anomaly = true_anomaly;
  const Rotationd R = rotation_from_rpy(0.4, -0.7, 1.1);
  orbit.radial = R.column(0), orbit.along_track = R.column(1);
  return orbit;
}

// The state of a free body at position `p` and velocity `v` in the orbital axes O at t = 0, without rotation in W.
State beside(const Model& model, const ReferenceOrbit& orbit, const Vector3d& p, const Vector3d& v) {
  const OrbitPoint at = orbit_point(orbit, 0);
  State state = zero_state(model);
  set_root_pose(model, 0, {Rotationd::identity(), orbit.position + at.R_WO * p}, state);
  const Vector3d in_world = v + cross(Vector3d{0, 0, at.rate}, p);
  set_root_twist(model, 0, {{0, 0, 0}, orbit.velocity + at.R_WO * in_world}, state);
  return state;
}
OrbitalMotion seen_in_orbit(const Model& model, const ReferenceOrbit& orbit, const State& state, double t) {
  return orbital_motion(orbit, orbit_point(orbit, t), root_pose(model, state, 0).p, root_twist(model, state, 0).linear);
}
State after(const Model& model, const PhaseSetup& setup, const State& start, double t) {
  PhaseDynamics dynamics(model, setup);
  const PhaseOutcome outcome = simulate_phase(dynamics, {start, 0, t}, kTight);
  EXPECT_TRUE(outcome.finished) << outcome.failure;
  return outcome.end_state;
}

// --- The magnetic field ---

// In the plane of the dipole: 2 B_0 (a/r)^3 at its poles, B_0 (a/r)^3 at its equator.
TEST(MagneticField, IsThatOfADipole) {
  const Vector3d g{kDipole[0], kDipole[1], kDipole[2]};
  const Vector3d pole = (-1 / norm(g)) * g, r = 1.1 * kDipoleRadius * pole;
  EXPECT_NEAR(norm(g), 29733.4e-9, 0.1e-9);  // [T]
  const double shrink = 1 / (1.1 * 1.1 * 1.1);
  EXPECT_LT(norm(magnetic_field({}, r, 0) + 2 * shrink * norm(g) * pole), 1e-18);
  const Vector3d across = (1 / norm(cross(pole, Vector3d{1, 0, 0}))) * cross(pole, Vector3d{1, 0, 0});
  const Vector3d equator = magnetic_field({}, kDipoleRadius * across, 0);
  EXPECT_LT(norm(equator - norm(g) * pole), 1e-18);  // to the north
}

// The pole of IGRF-14 for 2025.0: 80.8 deg N, 72.8 deg W (World Data Center for Geomagnetism, Kyoto). It rotates with
// the Earth, once per sidereal day.
TEST(MagneticField, RotatesWithTheEarth) {
  constexpr double kDegree = std::numbers::pi / 180;
  const Vector3d pole{-kDipole[0], -kDipole[1], -kDipole[2]};
  EXPECT_NEAR(std::asin(pole[2] / norm(pole)) / kDegree, 80.8, 0.05);
  EXPECT_NEAR(std::atan2(pole[1], pole[0]) / kDegree, -72.8, 0.05);
  const Rotationd R = rotation_from_rpy(0.3, -0.5, 0.9);
  const MagneticField field{R.column(2), R.column(0)};
  const Vector3d p{5e6, -3e6, 4e6};
  const double quarter = 0.5 * std::numbers::pi / kEarthRate;
  EXPECT_NEAR(4 * quarter, 86164.1, 0.1);  // [s]
  // At rest in W, the field is that of a point which has rotated backwards with the Earth.
  const Rotationd back = rotation_about(field.axis, -0.5 * std::numbers::pi);
  const Vector3d later = magnetic_field(field, p, quarter), seen = magnetic_field(field, back * p, 0);
  EXPECT_LT(norm(back * later - seen), 1e-18);
  EXPECT_GT(norm(later - magnetic_field(field, p, 0)), 1e-6);
  EXPECT_LT(norm(magnetic_field(field, p, 4 * quarter) - magnetic_field(field, p, 0)), 1e-18);
  EXPECT_TRUE(fault_of(field).empty());
  EXPECT_FALSE(fault_of(MagneticField{{0, 0, 1}, {0, 0.1, 1}}).empty());
}

// --- The orbit itself ---

TEST(Orbit, LowOrbitValues) {
  const OrbitPoint at = orbit_point(low_orbit(), 0);
  EXPECT_NEAR(mean_motion(low_orbit()), 1.1314e-3, 5e-8);
  EXPECT_DOUBLE_EQ(at.rate, mean_motion(low_orbit()));
  EXPECT_NEAR(3 * at.gradient * 10, 3.84e-5, 5e-8);  // [m/s^2]; 10 m above, at rest in the rotating axes
  // Two bodies of 1 t, 10 m apart, have a transverse moment of inertia of 50 t m^2. The torque is maximal at 45 degrees
  // to the vertical: 3/2 mu/R^3 times the moment of inertia.
  const Symmetric3d dumbbell = Symmetric3d::diagonal(0, 50e3, 50e3);
  const Vector3d torque =
      gravity_gradient_torque(at, at.R_WO * rotation_about({0, 0, 1}, std::numbers::pi / 4), dumbbell);
  EXPECT_NEAR(norm(torque), 1.5 * at.gradient * 50e3, 1e-15);
  EXPECT_NEAR(norm(torque), 0.096, 1e-4);
  EXPECT_NEAR(dot(torque, at.R_WO.column(2)), -norm(torque), 1e-15);  // restoring torque
}

// Gravity of one central body on two bodies: positions and velocities of both.
using Pair = std::array<long double, 12>;
Pair rate_of(const Pair& y) {
  Pair rate{};
  for (int body = 0; body < 2; ++body) {
    const long double* r = y.data() + 6 * body;
    const long double distance = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    const long double g = kMu / (distance * distance * distance);
    for (int i = 0; i < 3; ++i) rate[6 * body + i] = r[3 + i], rate[6 * body + 3 + i] = -g * r[i];
  }
  return rate;
}
Pair added(const Pair& y, long double h, const Pair& k) {
  Pair sum = y;
  for (std::size_t i = 0; i < y.size(); ++i) sum[i] += h * k[i];
  return sum;
}
Pair fall(Pair y, double until, int steps) {
  const long double h = static_cast<long double>(until) / steps;
  for (int n = 0; n < steps; ++n) {
    const Pair a = rate_of(y), b = rate_of(added(y, h / 2, a)), c = rate_of(added(y, h / 2, b)),
               d = rate_of(added(y, h, c));
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
  return y;
}
// Positions and velocities of both bodies relative to the central body at t = 0. The second differs from the first by p
// and v in W.
Pair both(const ReferenceOrbit& orbit, const Vector3d& p, const Vector3d& v) {
  const double e = orbit.eccentricity, nu = orbit.true_anomaly;
  const double parameter = orbit.semi_major_axis * (1 - e * e), speed = std::sqrt(orbit.mu / parameter);
  const Vector3d r = parameter / (1 + e * std::cos(nu)) * orbit.radial;
  const Vector3d u = speed * (e * std::sin(nu) * orbit.radial + (1 + e * std::cos(nu)) * orbit.along_track);
  Pair y{};
  for (int i = 0; i < 3; ++i)
    y[i] = r[i], y[3 + i] = u[i], y[6 + i] = static_cast<long double>(r[i]) + p[i],
    y[9 + i] = static_cast<long double>(u[i]) + v[i];
  return y;
}
Vector3d part_of(const Pair& y, int first) {
  return {static_cast<double>(y[first]), static_cast<double>(y[first + 1]), static_cast<double>(y[first + 2])};
}

TEST(Orbit, ReferencePointIsTwoBodyMotion) {
  Worst place("place of the reference point over its radius");
  int n = 0;
  for (double e : {0.0, 0.1, 0.6, 0.9}) {
    for (double nu : {0.0, 1.3, -2.5}) {
      const ReferenceOrbit orbit = low_orbit(e, nu);
      for (double t : {0.0, 700.0, 4000.0}) {
        const Vector3d r = part_of(fall(both(orbit, {}, {}), t, 40000), 0);
        const OrbitPoint at = orbit_point(orbit, t);
        EXPECT_LT(place.note(norm(at.radius * at.radial() - r) / norm(r), n++), 1e-11);
        // The axes rotate at the reported rate.
        const double dt = 1e-3;
        const Vector3d turned = orbit_point(orbit, t + dt).radial() - orbit_point(orbit, t - dt).radial();
        EXPECT_LT(norm(turned - 2 * dt * at.rate * at.R_WO.column(1)), 1e-12);
        EXPECT_NEAR(at.gradient * std::pow(at.radius, 3), kMu, 1e-10 * kMu);
      }
    }
  }
  // Backwards in time, over several periods.
  const ReferenceOrbit orbit = low_orbit(0.3, 0.5);
  const double period = 2 * std::numbers::pi / mean_motion(orbit);
  EXPECT_LT(norm(orbit_point(orbit, -7 * period).radial() - orbit.radial), 1e-12);
}

// --- Places ---

TEST(Orbit, DriftIsClohessyAndWiltshires) {
  const Model model = one_body(Symmetric3d::diagonal(1, 2, 2.5));
  const ReferenceOrbit orbit = low_orbit();
  const double n = mean_motion(orbit);
  PhaseSetup setup;
  setup.orbit = orbit;
  Worst worst("place beside the closed form, over 10 m");
  const Vector3d p{10, -4, 3}, v{2e-3, -5e-3, 1e-3};
  for (double t : {1.0, 300.0, 2000.0, 12000.0}) {
    const double c = std::cos(n * t), s = std::sin(n * t);
    const OrbitalMotion rest =
        seen_in_orbit(model, orbit, after(model, setup, beside(model, orbit, {10, 0, 0}, {}), t), t);
    const Vector3d drift{(4 - 3 * c) * 10, 6 * (s - n * t) * 10, 0};
    EXPECT_LT(worst.note(norm(rest.position - drift) / 10, static_cast<int>(t)), 2e-9);
    const OrbitalMotion moved = seen_in_orbit(model, orbit, after(model, setup, beside(model, orbit, p, v), t), t);
    const Vector3d place{(4 - 3 * c) * p[0] + s / n * v[0] + 2 / n * (1 - c) * v[1],
                         6 * (s - n * t) * p[0] + p[1] - 2 / n * (1 - c) * v[0] + (4 * s / n - 3 * t) * v[1],
                         p[2] * c + v[2] / n * s};
    const Vector3d speed{3 * n * s * p[0] + c * v[0] + 2 * s * v[1],
                         6 * n * (c - 1) * p[0] - 2 * s * v[0] + (4 * c - 3) * v[1], -p[2] * n * s + c * v[2]};
    EXPECT_LT(worst.note(norm(moved.position - place) / 10, static_cast<int>(t)), 2e-9);
    EXPECT_LT(norm(moved.velocity - speed), 1e-11);
  }
}

// A thrust in the rotating along-track direction, in the frame of all other computations.
TEST(Orbit, LoadRotatesWithOrbitalAxes) {
  const Model model = one_body(Symmetric3d::diagonal(1, 2, 2.5));  // 3 kg
  const ReferenceOrbit orbit = low_orbit();
  const double n = mean_motion(orbit), a = -2e-5;
  PhaseSetup setup;
  setup.orbit = orbit;
  setup.loads.resize(1);
  setup.loads[0].frame = LoadFrame::orbit;
  setup.loads[0].amplitude.linear = {0, 3 * a, 0};
  const double t = 3000;
  const State end = after(model, setup, beside(model, orbit, {}, {}), t);
  const Vector3d place = seen_in_orbit(model, orbit, end, t).position;
  const Vector3d expected{2 * a / (n * n) * (n * t - std::sin(n * t)),
                          a * (4 / (n * n) * (1 - std::cos(n * t)) - 1.5 * t * t), 0};
  EXPECT_LT(norm(place - expected), 1e-9 * norm(expected));
  EXPECT_GT(norm(expected), 100);
}

TEST(Orbit, LinearFieldErrorIsSecondOrder) {
  const Model model = one_body(Symmetric3d::diagonal(1, 2, 2.5));
  for (double e : {0.0, 0.2, 0.7}) {
    const ReferenceOrbit orbit = low_orbit(e, 0.9);
    PhaseSetup setup;
    setup.orbit = orbit;
    const double t = 2500;
    const auto error = [&](double r) {
      const Vector3d p = r * Vector3d{0.6, -0.5, 0.4}, v = r * Vector3d{2e-4, 3e-4, -1e-4};
      State start = zero_state(model);
      set_root_pose(model, 0, {Rotationd::identity(), p}, start);
      set_root_twist(model, 0, {{0, 0, 0}, v}, start);
      const Pair exact = fall(both(orbit, p, v), t, 20000);
      Pair difference{};
      for (int i = 0; i < 3; ++i) difference[i] = exact[6 + i] - exact[i];
      return norm(root_pose(model, after(model, setup, start, t), 0).p - part_of(difference, 0));
    };
    const double near = error(10), far = error(1000);
    std::printf("[ measured ] e = %g: %.3g m off at 10 m, %.3g m at 1 km\n", e, near, far);
    EXPECT_LT(near, 1e-3);
    EXPECT_NEAR(far / near, 1e4, 100);
  }
}

// --- Attitudes ---

// A slender body near the vertical librates with the frequency sqrt(3) n in the orbital plane and 2 n out of it.
TEST(Orbit, DumbbellLibrates) {
  const double I = 50e3;
  const ReferenceOrbit orbit = low_orbit();
  const double n = mean_motion(orbit), off = 1e-6, t = 4000;
  const OrbitPoint start = orbit_point(orbit, 0), end = orbit_point(orbit, t);
  const Model model = one_body(Symmetric3d::diagonal(1e-7 * I, I, I));
  PhaseSetup setup;
  setup.orbit = orbit;
  State state = zero_state(model);
  const Rotationd R_OB = rotation_about({0, 0, 1}, off) * rotation_about({0, 1, 0}, -off);
  set_root_pose(model, 0, {start.R_WO * R_OB, {0, 0, 0}}, state);
  set_root_twist(model, 0, {n * start.R_WO.column(2), {0, 0, 0}}, state);
  const Vector3d axis = transposed_times(end.R_WO, root_pose(model, after(model, setup, state, t), 0).R.column(0));
  const double swing = std::sqrt(3.0) * n * t;
  EXPECT_GT(swing, 7);
  EXPECT_NEAR(axis[1] / off, std::cos(swing), 2e-6);  // measured 4e-7: second order in the angle
  EXPECT_NEAR(axis[2] / off, std::cos(2 * n * t), 2e-6);
}

// The field is linear, so force and torque on a body are sums over its parts: a welded pair moves like the composite
// body.
TEST(Orbit, BodyEqualsWeldedParts) {
  BodyDescription root, welded;
  root.name = root.joint.name = "root";
  root.joint.type = JointType::free;
  root.mass = 1000, root.com = {0.1, 0, 0.2};
  root.inertia = Symmetric3d::diagonal(300, 400, 500);
  welded.name = welded.joint.name = "welded";
  welded.parent = "root";
  welded.X_PF = {rotation_about({0, 0.6, 0.8}, 1.1), {7, -5, 4}};
  welded.mass = 800, welded.com = {0, 0.3, 0};
  welded.inertia = Symmetric3d::diagonal(200, 300, 400);
  const Model pair = ModelBuilder().add(root).add(welded).build();
  RigidBodyInertiad whole = RigidBodyInertiad::about_com(root.mass, root.com, root.inertia);
  whole += welded.X_PF * RigidBodyInertiad::about_com(welded.mass, welded.com, welded.inertia);
  BodyDescription one = root;
  one.mass = whole.mass, one.com = whole.com(), one.inertia = whole.rotational_about_com();
  const Model single = ModelBuilder().add(one).build();
  PhaseSetup setup;
  setup.orbit = low_orbit(0.2, 1);
  Random random(3);
  const State start = random_state(pair, random, 2e-3);
  const State a = after(pair, setup, start, 2000), b = after(single, setup, start, 2000);
  EXPECT_LT(difference(a, b), 1e-9);
  EXPECT_GT(difference(a, start), 0.5);
  setup.orbit.reset();
  EXPECT_GT(difference(a, after(pair, setup, start, 2000)), 1e-2);  // the field has an effect
}

// --- In the phase ---

// A small and dense central body, so that the field is as strong as the other loads.
TEST(Orbit, ImpulseAndWorkBalance) {
  Worst momentum("momentum less impulse of the field, over the largest"), energy("energy less its work");
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 3, options.max_bodies = 9;
    options.targets = 1;
    const Model model = with_friction(random_model(options, random), 0.2, 0);
    const State start = random_state(model, random, 0.4);
    PhaseSetup setup;
    setup.drives = random_drives(model, start, i % 3 == 0 ? JointControl::prescribed : JointControl::pd, 2, random);
    setup.orbit.emplace(low_orbit(i % 2 == 0 ? 0 : 0.4, 0.3));
    setup.orbit->mu = 1e20;
    setup.orbit->position = random.vector(2), setup.orbit->velocity = random.vector(0.2);
    if (i % 4 == 3) setup.held_root = model.body_index("b0");
    PhaseDynamics dynamics(model, setup);
    EXPECT_TRUE(dynamics.is_disturbed());
    const State held = dynamics.unprojected_state(0, dynamics.initial(start, 0));
    const PhaseBalance balance = balance_under_loads(model, dynamics, held);
    EXPECT_LT(momentum.note(balance.momentum, i), 1e-11);
    EXPECT_LT(energy.note(balance.energy, i), 1e-11);
  }
}

// Results do not depend on the origin and velocity of the inertial frame of the computation.
TEST(Orbit, UniformlyMovingFramesAreEquivalent) {
  Random random(5);
  RobotOptions options;
  options.min_bodies = 4, options.max_bodies = 6;
  const Model model = random_model(options, random);
  const State start = random_state(model, random, 1e-2);
  const Vector3d origin{30, -200, 12}, velocity{0.2, -0.1, 0.3};
  PhaseSetup setup;
  setup.orbit = low_orbit(0.1, 2);
  const double t = 600;
  const State in_world = after(model, setup, start, t);
  const auto moved = [&](const State& state, const Vector3d& by, const Vector3d& by_velocity) {
    State result = state;
    Twistd V = root_twist(model, state, 0);
    V.linear += by_velocity;
    for (int k = 0; k < 3; ++k) result.q[model.bodies()[0].q + k] += by[k];
    set_root_twist(model, 0, V, result);
    return result;
  };
  setup.orbit->position = -origin, setup.orbit->velocity = -velocity;
  const State elsewhere = after(model, setup, moved(start, -origin, -velocity), t);
  EXPECT_LT(difference(in_world, moved(elsewhere, origin + t * velocity, velocity)), 1e-8);
  setup.orbit->position = Vector3d::zero();  // wrong: ignores the shift
  EXPECT_GT(difference(in_world, moved(after(model, setup, moved(start, -origin, -velocity), t), origin + t * velocity,
                                       velocity)),
            1e-2);
}

TEST(Orbit, FaultsAreNamed) {
  const Model model = one_body(Symmetric3d::diagonal(1, 2, 2.5));
  const auto message = [&](auto change) -> std::string {
    PhaseSetup setup;
    setup.orbit = low_orbit();
    change(setup);
    try {
      PhaseDynamics dynamics(model, setup);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  };
  const auto expect_message = [&](const std::string& part, auto change) {
    EXPECT_NE(message(change).find(part), std::string::npos) << message(change);
  };
  expect_message("none", [](PhaseSetup&) {});
  expect_message("gravitational parameter", [](PhaseSetup& s) { s.orbit->mu = 0; });
  expect_message("semi-major axis", [](PhaseSetup& s) { s.orbit->semi_major_axis = -1; });
  expect_message("eccentricity", [](PhaseSetup& s) { s.orbit->eccentricity = 1; });
  expect_message("unit vectors", [](PhaseSetup& s) { s.orbit->radial = {2, 0, 0}; });
  expect_message("perpendicular", [](PhaseSetup& s) { s.orbit->along_track = s.orbit->radial; });
  expect_message("not finite", [](PhaseSetup& s) { s.orbit->true_anomaly = NAN; });
  expect_message("axes of an orbit", [](PhaseSetup& s) {
    s.loads.resize(1), s.loads[0].frame = LoadFrame::orbit;
    s.orbit.reset();
  });
}

// --- Air and light ---

TEST(Stream, ForceFollowsSurfaceProperties) {
  Stream stream;
  stream.pressure = 4, stream.area = 0.5;
  const Vector3d d{0, 0, -1}, up{0, 0, 1};
  const auto near = [](const Vector3d& a, const Vector3d& b) { EXPECT_LT(norm(a - b), 1e-15); };
  near(stream_force(stream, d, up), {0, 0, -2});  // absorbed
  stream.specular = 1;
  near(stream_force(stream, d, up), {0, 0, -4});  // reflected
  // The force on a mirror is along its normal: 2 p A cos^2.
  const Vector3d tilted{0.6, 0, 0.8};
  near(stream_force(stream, d, tilted), -4 * 0.64 * tilted);
  stream.specular = 0, stream.diffuse = 1;
  near(stream_force(stream, d, up), {0, 0, -2 - 4.0 / 3});  // diffuse reflection adds 2/3
  stream.diffuse = 0;
  near(stream_force(stream, d, tilted), {0, 0, -2 * 0.8});
  near(stream_force(stream, d, -tilted), {0, 0, 0});  // the front side is in shadow
  stream.both_sides = true;
  near(stream_force(stream, d, -tilted), {0, 0, -2 * 0.8});
  stream.diffuse = 0.3, stream.specular = 0.4;
  near(stream_force(stream, d, -tilted), stream_force(stream, d, tilted));
}

// A plate that rotates in the stream: the momentum is the integral of p A cos^+(w t). The centre of pressure is at the
// centre of mass.
TEST(Stream, FollowsAttitude) {
  const Model model = one_body(Symmetric3d::diagonal(1, 1, 2));
  PhaseSetup setup;
  setup.loads.resize(1);
  setup.loads[0].stream.emplace();
  Stream& stream = *setup.loads[0].stream;
  stream.direction = {-1, 0, 0}, stream.normal = {1, 0, 0}, stream.pressure = 3, stream.area = 2;
  const double w = 0.5;
  State start = zero_state(model);
  set_root_twist(model, 0, {{0, 0, w}, {0, 0, 0}}, start);
  const auto momentum = [&](double t) { return 3.0 * root_twist(model, after(model, setup, start, t), 0).linear; };
  const double quarter = std::numbers::pi / 2 / w;
  EXPECT_LT(norm(momentum(0.8 * quarter) - Vector3d{-6 / w * std::sin(w * 0.8 * quarter), 0, 0}), 1e-11);
  EXPECT_LT(norm(momentum(2.5 * quarter) - Vector3d{-6 / w, 0, 0}), 1e-6);  // in the shadow
  setup.loads[0].profile.start = 0.5 * quarter;
  EXPECT_LT(norm(momentum(0.8 * quarter) -
                 Vector3d{-6 / w * (std::sin(w * 0.8 * quarter) - std::sin(w * 0.5 * quarter)), 0, 0}),
            1e-11);
}

}  // namespace orbit_test
}  // namespace grapnel::testing
