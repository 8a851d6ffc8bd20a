#include "import/mujoco_file.hpp"

#include <mujoco/mujoco.h>

#include <stdexcept>

#include "support/eigen_values.hpp"

namespace grapnel::testing {
namespace {

Vector3d vector(const double* x) { return {x[0], x[1], x[2]}; }
void write(const Vector3d& v, double* x) { x[0] = v[0], x[1] = v[1], x[2] = v[2]; }

Posed pose(const double* p, const double* m) {
  return {{{{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}}}, vector(p)};
}

}  // namespace

MujocoFile::MujocoFile(const std::filesystem::path& file) {
  char error[1000] = "";
  model_ = mj_loadXML(file.c_str(), nullptr, error, sizeof error);
  if (model_ == nullptr) throw std::runtime_error("MuJoCo: " + file.string() + ": " + error);
  data_ = mj_makeData(model_);
}

MujocoFile::~MujocoFile() {
  mj_deleteData(data_);
  mj_deleteModel(model_);
}

int MujocoFile::velocities() const { return model_->nv; }

int MujocoFile::body_id(const std::string& body) const {
  const int id = mj_name2id(model_, mjOBJ_BODY, body.c_str());
  if (id < 0) throw std::runtime_error("MuJoCo has no body '" + body + "'");
  return id;
}

int MujocoFile::joint_id(const std::string& joint) const {
  const int id = mj_name2id(model_, mjOBJ_JOINT, joint.c_str());
  if (id < 0) throw std::runtime_error("MuJoCo has no joint '" + joint + "'");
  return id;
}

void MujocoFile::set_state(const Model& model, const std::string& base, const State& state) {
  mj_resetData(model_, data_);
  write({0, 0, 0}, model_->opt.gravity);
  T_ = Eigen::MatrixXd::Zero(model_->nv, model.velocities());
  turned_ = Eigen::VectorXd::Zero(model_->nv);
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& b = model.bodies()[i];
    const JointType type = b.description.joint.type;
    if (type == JointType::fixed) continue;
    const int joint = type == JointType::free ? model_->body_jntadr[body_id(base)] : joint_id(b.description.joint.name);
    if (joint < 0) throw std::runtime_error("MuJoCo's body '" + base + "' does not move");
    const int q = model_->jnt_qposadr[joint], v = model_->jnt_dofadr[joint];
    for (int k = 0; k < coordinate_count(type); ++k) data_->qpos[q + k] = state.q[b.q + k];
    if (type != JointType::free) {
      data_->qvel[v] = state.v[b.v];
      T_(v, b.v) = 1;
      continue;
    }
    // MuJoCo orders velocities as [linear in W; angular in B]; its linear acceleration is that of the body's origin.
    const Rotationd R = root_pose(model, state, static_cast<int>(i)).R;
    const Vector3d angular = vector(&state.v[b.v]), linear = vector(&state.v[b.v + 3]);
    write(R * linear, data_->qvel + v);
    write(angular, data_->qvel + v + 3);
    write(R * cross(angular, linear), turned_.data() + v);
    T_.block(v, b.v + 3, 3, 3) = eigen(R);
    T_.block(v + 3, b.v, 3, 3).setIdentity();
  }
  mj_forward(model_, data_);
}

Eigen::MatrixXd MujocoFile::mass_matrix() const {
  Eigen::MatrixXd M(model_->nv, model_->nv);
  mj_fullM(model_, M.data(), data_->qM);
  return T_.transpose() * M * T_;
}

Eigen::VectorXd MujocoFile::bias() const {
  Eigen::MatrixXd M(model_->nv, model_->nv);
  mj_fullM(model_, M.data(), data_->qM);
  return T_.transpose() * (Eigen::Map<const Eigen::VectorXd>(data_->qfrc_bias, model_->nv) + M * turned_);
}

// MuJoCo lists equality constraints first; models of this size have dense rows.
Eigen::MatrixXd MujocoFile::equality_rows() const {
  if (mj_isSparse(model_) != 0) throw std::runtime_error("MuJoCo's constraint rows are sparse");
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(data_->efc_J, data_->ne, model_->nv) * T_;
}

Eigen::VectorXd MujocoFile::equality_defects() const {
  return Eigen::Map<const Eigen::VectorXd>(data_->efc_pos, data_->ne);
}

Posed MujocoFile::body_pose(const std::string& body) const {
  const int id = body_id(body);
  return pose(data_->xpos + 3 * id, data_->xmat + 9 * id);
}

Posed MujocoFile::site_pose(const std::string& site) const {
  const int id = mj_name2id(model_, mjOBJ_SITE, site.c_str());
  if (id < 0) throw std::runtime_error("MuJoCo has no site '" + site + "'");
  return pose(data_->site_xpos + 3 * id, data_->site_xmat + 9 * id);
}

std::vector<std::string> MujocoFile::site_names() const {
  std::vector<std::string> names;
  for (int i = 0; i < model_->nsite; ++i) {
    const char* name = mj_id2name(model_, mjOBJ_SITE, i);
    if (name != nullptr && model_->site_bodyid[i] > 0) names.emplace_back(name);
  }
  return names;
}

MujocoFile::JointData MujocoFile::joint_of(const std::string& body) const {
  const int joint = model_->body_jntadr[body_id(body)], v = model_->jnt_dofadr[joint];
  return {model_->dof_damping[v],          model_->dof_frictionloss[v],  model_->dof_armature[v],
          model_->jnt_limited[joint] != 0, model_->jnt_range[2 * joint], model_->jnt_range[2 * joint + 1]};
}

std::vector<MujocoFile::GeomData> MujocoFile::geoms_of(const std::string& body) const {
  std::vector<GeomData> geoms;
  const int id = body_id(body);
  for (int k = 0; k < model_->body_geomnum[id]; ++k) {
    const int g = model_->body_geomadr[id] + k;
    const double* q = model_->geom_quat + 4 * g;
    GeomData geom{model_->geom_type[g],
                  vector(model_->geom_size + 3 * g),
                  {rotation_matrix(Quaterniond{q[0], q[1], q[2], q[3]}), vector(model_->geom_pos + 3 * g)},
                  {}};
    if (geom.type == mjGEOM_MESH) {
      const int mesh = model_->geom_dataid[g];
      for (int i = 0; i < model_->mesh_vertnum[mesh]; ++i) {
        const float* v = model_->mesh_vert + 3 * (model_->mesh_vertadr[mesh] + i);
        geom.vertices.push_back(geom.X_BG * Vector3d{v[0], v[1], v[2]});
      }
    }
    geoms.push_back(std::move(geom));
  }
  return geoms;
}

MujocoFile::MassData MujocoFile::mass_of(const std::string& body) const {
  const int id = body_id(body);
  const double *I = model_->body_inertia + 3 * id, *q = model_->body_iquat + 4 * id;
  const Rotationd R = rotation_matrix(Quaterniond{q[0], q[1], q[2], q[3]});
  return {model_->body_mass[id], vector(model_->body_ipos + 3 * id),
          rotate(R, Symmetric3d::diagonal(I[0], I[1], I[2]))};
}

Model with_inertias_of(const MujocoFile& theirs, const Model& ours, Worst& difference) {
  ModelBuilder builder;
  for (std::size_t i = 0; i < ours.bodies().size(); ++i) {
    BodyDescription body = ours.bodies()[i].description;
    if (body.joint.type != JointType::fixed) {
      const Symmetric3d inertia = theirs.mass_of(body.name).inertia;
      difference.note(relative_difference(eigen(inertia), eigen(body.inertia)), static_cast<int>(i));
      body.inertia = inertia;
    }
    builder.add(std::move(body));
  }
  for (const Frame& frame : ours.frames())
    builder.add(FrameDescription{frame.name, ours.bodies()[frame.body].description.name, frame.X_BE});
  return builder.build();
}

}  // namespace grapnel::testing
