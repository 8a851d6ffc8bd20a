/// One contact in the plane against Routh's construction (E. J. Routh, Dynamics of a System of Rigid Bodies, 1905; Y.
/// Wang, M. T. Mason, Two-dimensional rigid-body collisions with friction, J. Applied Mechanics 59, 1992): the path in
/// the plane of impulses consists of two straight lines. This implementation uses only the bodies' masses.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "impact/contact_case.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace contact_routh_test {

// du = [a c; c b] dP, normal and tangent.
struct PlanarImpact {
  double a = 0, b = 0, c = 0, u_n = 0, u_t = 0, e = 0, mu = 0;
};

struct PlanarResult {
  double P_n = 0, P_t = 0;
  std::vector<ContactMode> modes;
  std::string kind;
};

// u_n and the work of the normal force as functions of P_n. u_n consists of two straight lines that join where sliding
// stops.
struct Lines {
  double u0, n1, n2, stop;
  double velocity(double P) const { return P <= stop ? u0 + n1 * P : u0 + n1 * stop + n2 * (P - stop); }
  // P_n at which u_n rises to w.
  double reaches(double w) const {
    if (n1 > 0 && (w - u0) / n1 <= stop) return (w - u0) / n1;
    return stop + (w - velocity(stop)) / n2;
  }
  double work(double P) const {
    const double first = std::min(P, stop);
    double sum = first * (u0 + 0.5 * n1 * first);
    if (P > stop) sum += (P - stop) * (velocity(stop) + 0.5 * n2 * (P - stop));
    return sum;
  }
  // P_n at which the work since maximum compression, at P_c, reaches W.
  double impulse_at_work(double W, double P_c) const {
    if (W <= 0) return P_c;
    if (P_c < stop) {
      const double P = P_c + std::sqrt(2 * W / n1);
      if (P <= stop) return P;
    }
    const double from = std::max(P_c, stop), u = std::max(0.0, velocity(from));
    const double left = W - (work(from) - work(P_c));
    return from + 2 * left / (u + std::sqrt(u * u + 2 * n2 * left));
  }
};

PlanarResult routh(const PlanarImpact& x, RestitutionHypothesis hypothesis) {
  const double s = x.u_t > 0 ? 1 : -1;
  Lines lines{x.u_n, x.a - x.mu * s * x.c, 0, INFINITY};
  const double t1 = x.c - x.mu * s * x.b;
  if (s * t1 < 0) lines.stop = -x.u_t / t1;
  const bool sticks = std::abs(x.c) <= x.mu * x.b;
  const double along = sticks ? -x.c / x.b : (x.c > 0 ? -x.mu : x.mu);  // dP_t/dP_n after the stop
  lines.n2 = x.a + along * x.c;
  const double P_c = lines.reaches(0);
  PlanarResult r;
  if (hypothesis == RestitutionHypothesis::newton) {
    r.P_n = lines.reaches(-x.e * x.u_n);
  } else if (hypothesis == RestitutionHypothesis::poisson) {
    r.P_n = (1 + x.e) * P_c;
  } else {
    r.P_n = lines.impulse_at_work(-x.e * x.e * lines.work(P_c), P_c);
  }
  r.modes = {ContactMode::sliding};
  r.P_t = -x.mu * s * std::min(r.P_n, lines.stop);
  r.kind = "slides";
  if (r.P_n > lines.stop) {
    r.P_t += along * (r.P_n - lines.stop);
    // After the stop the contact sticks, or slides again in the direction given by c.
    r.modes.push_back(sticks ? ContactMode::sticking : ContactMode::reversed);
    r.kind = std::string(sticks ? "sticks " : "reverses ") + (lines.stop < P_c ? "before" : "after");
  }
  return r;
}

struct PlanarBody {
  double mass = 0, inertia = 1;  // mass 0: fixed
  double x = 0, z = 0;           // of the centre of mass
  double v_x = 0, v_z = 0, w = 0;
};

// Bodies in the plane y = 0 that touch at the origin; normal at `angle` from z, towards body 0.
struct PlanarPair {
  PlanarBody body[2];
  double angle = 0, e = 0, mu = 0;

  // Velocity of body `i` at the origin along d = (d_x, d_z), and its change per impulse along f.
  double velocity(int i, double d_x, double d_z) const {
    const PlanarBody& p = body[i];
    // w about y: v = w x r with r = (-x, -z).
    return d_x * (p.v_x - p.w * p.z) + d_z * (p.v_z + p.w * p.x);
  }
  double answer(int i, double d_x, double d_z, double f_x, double f_z) const {
    const PlanarBody& p = body[i];
    if (p.mass == 0) return 0;
    const double arm_d = -p.z * d_x + p.x * d_z, arm_f = -p.z * f_x + p.x * f_z;
    return (d_x * f_x + d_z * f_z) / p.mass + arm_d * arm_f / p.inertia;
  }
  PlanarImpact planar() const {
    const double n_x = std::sin(angle), n_z = std::cos(angle), t_x = n_z, t_z = -n_x;
    PlanarImpact q;
    q.e = e, q.mu = mu;
    for (int i = 0; i < 2; ++i) {
      q.a += answer(i, n_x, n_z, n_x, n_z), q.b += answer(i, t_x, t_z, t_x, t_z), q.c += answer(i, n_x, n_z, t_x, t_z);
      q.u_n += (i == 0 ? 1 : -1) * velocity(i, n_x, n_z), q.u_t += (i == 0 ? 1 : -1) * velocity(i, t_x, t_z);
    }
    return q;
  }
  ContactCase spatial() const {
    std::vector<Lump> bodies;
    for (int i = 0; i < 2; ++i) {
      const PlanarBody& p = body[i];
      bodies.push_back({i == 0 ? "a" : "b",
                        p.mass,
                        {0.6 * p.inertia, p.inertia, 0.7 * p.inertia},
                        {p.x, 0, p.z},
                        {{0, p.w, 0}, {p.v_x, 0, p.v_z}}});
    }
    ContactCase c = lumps(bodies);
    c.contacts = {{c.model.body_index("a"),
                   c.model.body_index("b"),
                   Vector3d::zero(),
                   {std::sin(angle), 0, std::cos(angle)},
                   e,
                   mu,
                   1}};
    return c;
  }
};

// Compares the solutions and returns the kind of path.
std::string compare(const PlanarPair& pair, RestitutionHypothesis h, Worst& worst, int index) {
  const PlanarResult expected = routh(pair.planar(), h);
  const ImpactSolution s = pair.spatial().solve(h);
  EXPECT_EQ(s.status, ImpactSolution::Status::solved) << s.message;
  const double P_t =
      s.points[0].tangential[0] * std::cos(pair.angle) - s.points[0].tangential[2] * std::sin(pair.angle);
  const double miss = std::hypot(s.points[0].normal - expected.P_n, P_t - expected.P_t);
  EXPECT_LT(worst.note(miss / expected.P_n, index), 1e-9);  // measured 1.2e-11
  EXPECT_EQ(s.points[0].modes, expected.modes);
  EXPECT_NEAR(s.points[0].tangential[1], 0, 1e-12 * expected.P_n);
  return expected.kind;
}

TEST(RouthConstruction, RandomPlanarPairs) {
  for (RestitutionHypothesis h : kHypotheses) {
    Worst worst("planar pairs: impulse against Routh's, hypothesis " + std::to_string(static_cast<int>(h)));
    std::map<std::string, int> kinds;
    for (int i = 0; i < test::repetitions(3000); ++i) {
      SCOPED_TRACE(seed_note(i));
      Random random(90000 + i);
      PlanarPair pair;
      for (PlanarBody& p : pair.body) {
        p = {random.log_uniform(0.2, 20), 0, random.uniform(-1, 1), random.uniform(-1, 1)};
        p.inertia = p.mass * random.log_uniform(0.03, 0.6);
        p.v_x = random.uniform(-1, 1), p.v_z = random.uniform(-1, 1), p.w = random.uniform(-2, 2);
      }
      pair.angle = random.uniform(-3, 3);
      if (pair.planar().u_n > 0) pair.angle += 3.14159265358979;
      pair.e = random.uniform(0, 1), pair.mu = random.uniform(0, 1.2);
      if (pair.planar().u_n > -0.02) continue;
      ++kinds[compare(pair, h, worst, i)];
    }
    for (const char* kind : {"slides", "sticks before", "sticks after", "reverses before", "reverses after"}) {
      EXPECT_GT(kinds[kind], test::kSanitized ? 3 : 50) << kind;
    }
  }
}

// A uniform rod of 1 m and 1 kg falls on its end at different slopes and horizontal speeds.
TEST(RouthConstruction, FallingRod) {
  for (RestitutionHypothesis h : kHypotheses) {
    Worst worst("falling rod: impulse against Routh's, hypothesis " + std::to_string(static_cast<int>(h)));
    std::map<std::string, int> kinds;
    int index = 0;
    for (double slope : {0.2, 0.5, 0.8, 1.1, 1.4}) {
      for (double mu : {0.1, 0.3, 0.6, 1.0}) {
        for (double sideways : {-1.0, -0.3, -0.03, 0.03, 0.3, 1.0}) {
          for (double e : {0.0, 0.5, 1.0}) {
            SCOPED_TRACE(++index);
            PlanarPair pair;
            pair.body[0] = {1, 1.0 / 12, 0.5 * std::cos(slope), 0.5 * std::sin(slope), sideways, -1, 0};
            pair.e = e, pair.mu = mu;
            ++kinds[compare(pair, h, worst, index)];
          }
        }
      }
    }
    for (const char* kind : {"slides", "sticks before", "sticks after", "reverses before", "reverses after"}) {
      EXPECT_GT(kinds[kind], 5) << kind;
    }
  }
}

// Newton's hypothesis with friction creates energy in some falls of the rod (T. R. Kane's puzzle of 1984 with a double
// pendulum); Poisson's and Stronge's hypotheses never do so for one contact.
TEST(RouthConstruction, NewtonsHypothesisCanCreateEnergy) {
  int created = 0;
  for (double slope : {0.2, 0.5, 0.8, 1.1, 1.4}) {
    for (double mu : {0.1, 0.3, 0.6, 1.0}) {
      for (double sideways : {-1.0, -0.3, -0.1, 0.1, 0.3, 1.0}) {
        PlanarPair pair;
        pair.body[0] = {1, 1.0 / 12, 0.5 * std::cos(slope), 0.5 * std::sin(slope), sideways, -1, 0};
        pair.e = 0.9, pair.mu = mu;
        const ContactCase c = pair.spatial();
        const double before = kinetic_energy_of(c, c.state.v);
        for (RestitutionHypothesis h : kHypotheses) {
          const ImpactSolution s = c.solve(h);
          const double gain = kinetic_energy_of(c, s.velocity) - before;
          EXPECT_EQ(s.energy_created, gain > 1e-9 * before);
          if (h == RestitutionHypothesis::newton) {
            created += s.energy_created;
          } else {
            EXPECT_LE(gain, 1e-12 * before);
          }
        }
      }
    }
  }
  EXPECT_GT(created, 3);
}

}  // namespace contact_routh_test
}  // namespace grapnel::testing
