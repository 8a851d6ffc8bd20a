#pragma once

/// @file
/// Free rigid bodies with contacts between them, integrated by the classical Runge-Kutta method with a fixed step.

#include <algorithm>
#include <array>
#include <iterator>
#include <vector>

#include "grapnel/contact/pair_contact.hpp"

namespace grapnel::testing {

struct FreeBody {
  double mass = 1;                                       // 0: fixed
  Symmetric3d inertia = Symmetric3d::diagonal(1, 1, 1);  // about the centre of mass, the body's origin
  Vector3d p = Vector3d::zero(), v = Vector3d::zero(), w = Vector3d::zero();  // in W
  Quaterniond q = Quaterniond::identity();

  MovingBody motion() const { return {{rotation_matrix(q), p}, {w, v}}; }
  Vector3d spin() const { return rotate(rotation_matrix(q), inertia) * w; }  // angular momentum
  double kinetic_energy() const { return mass > 0 ? 0.5 * (mass * dot(v, v) + dot(w, spin())) : 0; }
};

class FreeBodies {
 public:
  struct Link {
    int a, b;
    PairContact contact;
    StickState stick = {};
  };
  std::vector<FreeBody> bodies;
  std::vector<Link> links;
  Vector3d gravity = Vector3d::zero();
  double dissipated = 0;  // by damping and friction [J]

  Vector3d linear_momentum() const {
    Vector3d sum = Vector3d::zero();
    for (const FreeBody& b : bodies) sum += b.mass * b.v;
    return sum;
  }
  Vector3d angular_momentum() const {
    Vector3d sum = Vector3d::zero();
    for (const FreeBody& b : bodies) sum += cross(b.p, b.mass * b.v) + (b.mass > 0 ? b.spin() : Vector3d::zero());
    return sum;
  }
  double energy() {
    double sum = 0;
    for (const FreeBody& b : bodies) sum += b.kinetic_energy() - b.mass * dot(gravity, b.p);
    for (Link& l : links) sum += l.contact.elastic_energy(bodies[l.a].motion().X_WB, bodies[l.b].motion().X_WB);
    return sum;
  }
  void step(double h) {
    const std::vector<FreeBody> start = bodies;
    std::vector<StickState> stuck, stick_sum(links.size());
    for (const Link& l : links) stuck.push_back(l.stick);
    std::vector<Rate> sum(bodies.size()), rate(bodies.size());
    std::vector<StickState> stick_rate(links.size());
    double power_sum = 0;
    const double weights[] = {1, 2, 2, 1}, places[] = {0, 0.5, 0.5, 1};
    for (int stage = 0; stage < 4; ++stage) {
      if (stage > 0) advance(start, rate, places[stage] * h), advance_stick(stuck, stick_rate, places[stage] * h);
      power_sum += weights[stage] * derive(rate);
      for (std::size_t i = 0; i < bodies.size(); ++i) sum[i].add(weights[stage], rate[i]);
      for (std::size_t i = 0; i < links.size(); ++i) {
        stick_rate[i] = links[i].contact.last().stick_rate;
        stick_sum[i].slip += (weights[stage] / 6) * stick_rate[i].slip;
        stick_sum[i].spin += weights[stage] / 6 * stick_rate[i].spin;
      }
    }
    for (Rate& r : sum) r.scale(1.0 / 6);
    advance(start, sum, h), advance_stick(stuck, stick_sum, h);
    for (Link& l : links) {
      if (!l.contact.last().touches) l.stick = {};
    }
    dissipated += power_sum / 6 * h;
  }

 private:
  struct Rate {
    Vector3d p = Vector3d::zero(), v = Vector3d::zero(), w = Vector3d::zero();
    Quaterniond q{0, 0, 0, 0};
    void add(double s, const Rate& r) {
      p += s * r.p, v += s * r.v, w += s * r.w;
      q.w += s * r.q.w, q.x += s * r.q.x, q.y += s * r.q.y, q.z += s * r.q.z;
    }
    void scale(double s) {
      p *= s, v *= s, w *= s;
      q.w *= s, q.x *= s, q.y *= s, q.z *= s;
    }
  };
  static Vector3d solve(const Symmetric3d& I, const Vector3d& b) {
    const Vector3d r0{I.xx, I.xy, I.xz}, r1{I.xy, I.yy, I.yz}, r2{I.xz, I.yz, I.zz};
    const double det = dot(r0, cross(r1, r2));
    return (1 / det) * (b[0] * cross(r1, r2) + b[1] * cross(r2, r0) + b[2] * cross(r0, r1));
  }
  void advance(const std::vector<FreeBody>& start, const std::vector<Rate>& rate, double h) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      FreeBody& b = bodies[i];
      b = start[i];
      b.p += h * rate[i].p, b.v += h * rate[i].v, b.w += h * rate[i].w;
      Quaterniond q{b.q.w + h * rate[i].q.w, b.q.x + h * rate[i].q.x, b.q.y + h * rate[i].q.y, b.q.z + h * rate[i].q.z};
      const double n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
      b.q = {q.w / n, q.x / n, q.y / n, q.z / n};
    }
  }
  void advance_stick(const std::vector<StickState>& start, const std::vector<StickState>& rate, double h) {
    for (std::size_t i = 0; i < links.size(); ++i)
      links[i].stick = {start[i].slip + h * rate[i].slip, start[i].spin + h * rate[i].spin};
  }
  // Returns the dissipated power.
  double derive(std::vector<Rate>& rate) {
    std::vector<Wrenchd> load(bodies.size(), Wrenchd::zero());
    double power = 0;
    for (Link& l : links) {
      const ContactForce& f = l.contact.evaluate(bodies[l.a].motion(), bodies[l.b].motion(), l.stick);
      load[l.a] += shift(f.on_a, bodies[l.a].p - f.p_WC);
      load[l.b] += shift(f.on_b, bodies[l.b].p - f.p_WC);
      power += f.damping_power + f.friction_power;
    }
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const FreeBody& b = bodies[i];
      rate[i] = {};
      if (b.mass == 0) continue;
      const Rotationd R = rotation_matrix(b.q);
      const Vector3d w_B = transposed_times(R, b.w);
      rate[i].p = b.v, rate[i].q = quaternion_rate(b.q, w_B);
      rate[i].v = (1 / b.mass) * load[i].linear + gravity;
      rate[i].w = solve(rotate(R, b.inertia), load[i].angular - cross(b.w, b.spin()));
    }
    return power;
  }
};

inline FreeBody solid_sphere(double mass, double radius, const Vector3d& p) {
  const double I = 0.4 * mass * radius * radius;
  return {mass, Symmetric3d::diagonal(I, I, I), p};
}
inline FreeBody solid_box(double mass, const Vector3d& s, const Vector3d& p) {
  const double k = mass / 12;
  return {mass,
          Symmetric3d::diagonal(k * (s[1] * s[1] + s[2] * s[2]), k * (s[0] * s[0] + s[2] * s[2]),
                                k * (s[0] * s[0] + s[1] * s[1])),
          p};
}

}  // namespace grapnel::testing
