#include "engines/mujoco_engine.hpp"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <Eigen/Eigenvalues>

#include "engines/mujoco_load.hpp"
#include "support/eigen_values.hpp"

namespace grapnel::testing {
namespace {

std::string numbers(const Vector3d& v) { return fmt::format("{:.17g} {:.17g} {:.17g}", v[0], v[1], v[2]); }
std::string numbers(const Quaterniond& q) { return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", q.w, q.x, q.y, q.z); }

Rotationd rotation_of(const Eigen::Matrix3d& m) {
  Rotationd R;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = m(i, j);
  }
  return R;
}

// Principal moments and axes from here: MuJoCo's own diagonalization of `fullinertia` stops at 1e-12.
std::string inertial(const BodyDescription& d) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(eigen(d.inertia));
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  const Eigen::Vector3d moments = solver.eigenvalues();
  return fmt::format("<inertial pos='{}' quat='{}' mass='{:.17g}' diaginertia='{:.17g} {:.17g} {:.17g}'/>\n",
                     numbers(d.com), numbers(quaternion_from(rotation_of(axes))), d.mass, moments[0], moments[1],
                     moments[2]);
}

std::string joint(const BodyDescription& d) {
  const char* type = nullptr;
  switch (d.joint.type) {
    case JointType::fixed:
      return {};
    case JointType::free:
      return fmt::format("<freejoint name='{}'/>\n", d.joint.name);
    case JointType::spherical:
      return fmt::format("<joint name='{}' type='ball'/>\n", d.joint.name);
    case JointType::prismatic:
      type = "slide";
      break;
    default:
      type = "hinge";
      break;
  }
  std::string spring;
  if (const auto& s = d.joint.spring)
    spring =
        fmt::format(" stiffness='{:.17g}' damping='{:.17g}' springref='{:.17g}'", s->stiffness, s->damping, s->rest);
  return fmt::format("<joint name='{}' type='{}' axis='{}' armature='{:.17g}'{}/>\n", d.joint.name, type,
                     numbers(d.joint.axis), d.joint.reflected_inertia(), spring);
}

void append_body(const Model& model, int index, std::string& xml) {
  const BodyDescription& d = model.bodies()[index].description;
  xml += fmt::format("<body name='{}' pos='{}' quat='{}'>\n", d.name, numbers(d.X_PF.p),
                     numbers(quaternion_from(d.X_PF.R)));
  xml += joint(d) + inertial(d);
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    if (model.bodies()[i].parent == index) append_body(model, static_cast<int>(i), xml);
  }
  xml += "</body>\n";
}

Vector3d vector(const double* x) { return {x[0], x[1], x[2]}; }
void write(const Vector3d& v, double* x) { x[0] = v[0], x[1] = v[1], x[2] = v[2]; }

}  // namespace

std::string mjcf(const Model& model) {
  std::string xml =
      "<mujoco>\n<compiler angle='radian' coordinate='local' inertiafromgeom='false' boundmass='0' boundinertia='0' "
      "balanceinertia='false' fusestatic='false'/>\n"
      "<option><flag constraint='disable' contact='disable'/></option>\n<worldbody>\n";
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    if (model.bodies()[i].parent < 0) append_body(model, static_cast<int>(i), xml);
  }
  return xml + "</worldbody>\n</mujoco>\n";
}

MujocoEngine::MujocoEngine(const Model& model)
    : grapnel_(model), model_(load_mjcf(mjcf(model))), data_(mj_makeData(model_)) {
  for (const Body& b : model.bodies()) {
    // MuJoCo orders bodies depth first: match them by name.
    const int body = mj_name2id(model_, mjOBJ_BODY, b.description.name.c_str());
    const bool moves = model_->body_jntnum[body] > 0;
    const int joint = model_->body_jntadr[body];
    places_.push_back({body, moves ? model_->jnt_qposadr[joint] : -1, moves ? model_->jnt_dofadr[joint] : -1});
  }
}

MujocoEngine::~MujocoEngine() {
  mj_deleteData(data_);
  mj_deleteModel(model_);
}

std::vector<double> MujocoEngine::acceleration(const State& state, const Forces& forces) {
  state_ = state;
  mj_resetData(model_, data_);
  write(forces.gravity, model_->opt.gravity);
  const auto force = [&](int v) { return forces.generalized.empty() ? 0.0 : forces.generalized[v]; };
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Body& b = grapnel_.bodies()[i];
    const Place& at = places_[i];
    const JointType type = b.description.joint.type;
    for (int k = 0; k < coordinate_count(type); ++k) data_->qpos[at.q + k] = state.q[b.q + k];
    if (type == JointType::free) {
      const Rotationd R = root_pose(grapnel_, state, static_cast<int>(i)).R;
      for (int k = 0; k < 3; ++k) {
        data_->qvel[at.v + 3 + k] = state.v[b.v + k];
        data_->qfrc_applied[at.v + 3 + k] = force(b.v + k);
      }
      write(R * vector(&state.v[b.v + 3]), data_->qvel + at.v);
      write(R * Vector3d{force(b.v + 3), force(b.v + 4), force(b.v + 5)}, data_->qfrc_applied + at.v);
      continue;
    }
    for (int k = 0; k < velocity_count(type); ++k) {
      data_->qvel[at.v + k] = state.v[b.v + k];
      data_->qfrc_applied[at.v + k] = force(b.v + k);
    }
  }
  mj_kinematics(model_, data_);
  for (const ExternalWrench& e : forces.external) {
    // MuJoCo expects [force; moment] at the body's centre of mass.
    const int body = places_[e.body].body;
    const Wrenchd F = shift(e.F_W, vector(data_->xipos + 3 * body) - e.p_WP);
    for (int k = 0; k < 3; ++k) {
      data_->xfrc_applied[6 * body + k] += F.linear[k];
      data_->xfrc_applied[6 * body + 3 + k] += F.angular[k];
    }
  }
  mj_forward(model_, data_);

  std::vector<double> vdot(grapnel_.velocities());
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Body& b = grapnel_.bodies()[i];
    const Place& at = places_[i];
    if (b.description.joint.type != JointType::free) {
      for (int k = 0; k < velocity_count(b.description.joint.type); ++k) vdot[b.v + k] = data_->qacc[at.v + k];
      continue;
    }
    const Rotationd R = root_pose(grapnel_, state, static_cast<int>(i)).R;
    const Vector3d turn = cross(vector(&state.v[b.v]), vector(&state.v[b.v + 3]));
    write(vector(data_->qacc + at.v + 3), &vdot[b.v]);
    write(transposed_times(R, vector(data_->qacc + at.v)) - turn, &vdot[b.v + 3]);
  }
  return vdot;
}

Eigen::MatrixXd MujocoEngine::mass_matrix() const {
  const int n = model_->nv;
  Eigen::MatrixXd M(n, n), T = Eigen::MatrixXd::Zero(n, n);
  mj_fullM(model_, M.data(), data_->qM);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Body& b = grapnel_.bodies()[i];
    const Place& at = places_[i];
    if (b.description.joint.type == JointType::free) {
      T.block(at.v, b.v + 3, 3, 3) = eigen(root_pose(grapnel_, state_, static_cast<int>(i)).R);
      T.block(at.v + 3, b.v, 3, 3).setIdentity();
    } else {
      for (int k = 0; k < velocity_count(b.description.joint.type); ++k) T(at.v + k, b.v + k) = 1;
    }
  }
  return T.transpose() * M * T;
}

Eigen::VectorXd MujocoEngine::bias() const {
  // M T vdot + M (dT/dt) v + c_mj = f_mj; the middle term on a free root: [R (w x v); 0].
  const int n = model_->nv;
  Eigen::MatrixXd M(n, n);
  mj_fullM(model_, M.data(), data_->qM);
  Eigen::VectorXd turned = Eigen::VectorXd::Zero(n);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Body& b = grapnel_.bodies()[i];
    if (b.description.joint.type != JointType::free) continue;
    const Vector3d turn = cross(vector(&state_.v[b.v]), vector(&state_.v[b.v + 3]));
    write(root_pose(grapnel_, state_, static_cast<int>(i)).R * turn, turned.data() + places_[i].v);
  }
  const Eigen::VectorXd c = Eigen::Map<const Eigen::VectorXd>(data_->qfrc_bias, n) + M * turned;
  Eigen::VectorXd result(n);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Body& b = grapnel_.bodies()[i];
    const Place& at = places_[i];
    if (b.description.joint.type == JointType::free) {
      const Rotationd R = root_pose(grapnel_, state_, static_cast<int>(i)).R;
      write(transposed_times(R, vector(c.data() + at.v)), result.data() + b.v + 3);
      write(vector(c.data() + at.v + 3), result.data() + b.v);
    } else {
      for (int k = 0; k < velocity_count(b.description.joint.type); ++k) result[b.v + k] = c[at.v + k];
    }
  }
  return result;
}

}  // namespace grapnel::testing
