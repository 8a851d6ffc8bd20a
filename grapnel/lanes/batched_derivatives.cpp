#include "grapnel/lanes/batched_derivatives.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "grapnel/dynamics/dynamics_derivatives.hpp"
#include "grapnel/lanes/states.hpp"

namespace grapnel {
namespace {

// Inputs of several states; `input`: forces of forward, accelerations of inverse dynamics.
struct StateBatch {
  const Model& model;
  std::span<const double> q, v, input;
  const Vector3d& gravity;
  std::size_t count, n;

  StateBatch(const Model& m, std::span<const double> q_given, std::span<const double> v_given,
             std::span<const double> input_given, const Vector3d& g, const char* function)
      : model(m), q(q_given), v(v_given), input(input_given), gravity(g), count(0), n(m.velocities()) {
    const auto nq = static_cast<std::size_t>(m.coordinates());
    count = nq > 0 ? q.size() / nq : 0;
    if (q.size() != count * nq || v.size() != count * n || input.size() != count * n)
      throw std::invalid_argument(std::string(function) + ": q, v and the third argument have " +
                                  std::to_string(q.size()) + ", " + std::to_string(v.size()) + " and " +
                                  std::to_string(input.size()) + " numbers; expected " + std::to_string(nq) + ", " +
                                  std::to_string(n) + " and " + std::to_string(n) + " per state");
  }
  State state(std::size_t k) const {
    const auto nq = static_cast<std::size_t>(model.coordinates());
    const std::span<const double> own_q = q.subspan(k * nq, nq), own_v = v.subspan(k * n, n);
    return {{own_q.begin(), own_q.end()}, {own_v.begin(), own_v.end()}};
  }
  std::vector<double> input_of(std::size_t k) const {
    const std::span<const double> own = input.subspan(k * n, n);
    return {own.begin(), own.end()};
  }
  BatchedDerivatives results() const {
    BatchedDerivatives r;
    r.value.resize(count * n);
    for (std::vector<double>* matrix : {&r.dq, &r.dv, &r.by_input}) matrix->resize(count * n * n);
    return r;
  }
  lanes::StateCases cases() const {
    lanes::StateCases in;
    in.count = static_cast<std::int64_t>(count);
    in.q = {q.data(), model.coordinates()}, in.v = {v.data(), static_cast<std::int64_t>(n)};
    for (int i = 0; i < 3; ++i) in.gravity[i] = gravity[i];
    return in;
  }
};

lanes::StateDerivatives pointers_of(BatchedDerivatives& r) {
  return {r.value.data(), r.dq.data(), r.dv.data(), r.by_input.data(), nullptr};
}

void put(const std::vector<double>& value, const RowMatrix& dq, const RowMatrix& dv, const RowMatrix& by_input,
         std::size_t k, BatchedDerivatives& to) {
  const std::size_t n = value.size();
  std::copy(value.begin(), value.end(), to.value.data() + k * n);
  std::copy_n(dq.data(), n * n, to.dq.data() + k * n * n);
  std::copy_n(dv.data(), n * n, to.dv.data() + k * n * n);
  std::copy_n(by_input.data(), n * n, to.by_input.data() + k * n * n);
}

}  // namespace

BatchedDerivatives batched_forward_dynamics_derivatives(const Model& model, std::span<const double> q,
                                                        std::span<const double> v, std::span<const double> tau,
                                                        const Vector3d& gravity) {
  const StateBatch batch(model, q, v, tau, gravity, "batched_forward_dynamics_derivatives");
  BatchedDerivatives result = batch.results();
  if (model.tree().chains.empty()) {
    lanes::StateCases in = batch.cases();
    in.force = {tau.data(), static_cast<std::int64_t>(batch.n)};
    in.forward = pointers_of(result);
    lanes::States(model).run(in);
    return result;
  }
  const auto workspace = make_derivatives_workspace(model);
  ForwardDynamicsDerivatives d;
  for (std::size_t k = 0; k < batch.count; ++k) {
    forward_dynamics_derivatives(model, batch.state(k), {batch.input_of(k), {}, gravity}, *workspace, d);
    put(d.vdot, d.dq, d.dv, d.dtau, k, result);
  }
  return result;
}

BatchedDerivatives batched_inverse_dynamics_derivatives(const Model& model, std::span<const double> q,
                                                        std::span<const double> v, std::span<const double> vdot,
                                                        const Vector3d& gravity) {
  const StateBatch batch(model, q, v, vdot, gravity, "batched_inverse_dynamics_derivatives");
  BatchedDerivatives result = batch.results();
  if (model.tree().chains.empty()) {
    lanes::StateCases in = batch.cases();
    in.acceleration = {vdot.data(), static_cast<std::int64_t>(batch.n)};
    in.inverse = pointers_of(result);
    lanes::States(model).run(in);
    return result;
  }
  const auto workspace = make_derivatives_workspace(model);
  InverseDynamicsDerivatives d;
  for (std::size_t k = 0; k < batch.count; ++k) {
    inverse_dynamics_derivatives(model, batch.state(k), batch.input_of(k), {{}, {}, gravity}, *workspace, d);
    put(d.tau, d.dq, d.dv, d.dvdot, k, result);
  }
  return result;
}

}  // namespace grapnel
