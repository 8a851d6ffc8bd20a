#include "engines/mujoco_contacts.hpp"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "engines/mujoco_engine.hpp"
#include "engines/mujoco_load.hpp"

namespace grapnel::testing {
namespace {

using Shape = Geometry::Shape;

MujocoContacts* active = nullptr;  // whose model is stepped

Vector3d vector_of(const double* x) { return {x[0], x[1], x[2]}; }
std::string text(const Vector3d& v) { return fmt::format("{:.17g} {:.17g} {:.17g}", v[0], v[1], v[2]); }

std::string placed(const Posed& X) {
  const Quaterniond q = quaternion_from(X.R);
  return fmt::format("pos='{}' quat='{:.17g} {:.17g} {:.17g} {:.17g}'", text(X.p), q.w, q.x, q.y, q.z);
}

// A sphere on the axis of a capsule.
struct Part {
  double z, share;
};

// A capsule in the first place of a pair => its ends, and the middles of equal lengths of its axis (23.4a); a sphere =>
// itself.
std::vector<Part> parts_of(const EngineSurface& first, int side_spheres) {
  if (first.geometry.shape == Shape::sphere) return {{0, 1}};
  if (first.geometry.shape != Shape::capsule) throw std::invalid_argument("MujocoContacts: neither sphere nor capsule");
  const double length = first.geometry.size[1];
  std::vector<Part> parts = {{-0.5 * length, 1}, {0.5 * length, 1}};
  for (int i = 0; i < side_spheres; ++i)
    parts.push_back({length * ((i + 0.5) / side_spheres - 0.5), 1.0 / side_spheres});
  return parts;
}

std::string geom(const std::string& name, const EngineSurface& s) {
  const Geometry& g = s.geometry;
  const std::string start = fmt::format("<geom name='{}' contype='0' conaffinity='0' {} ", name, placed(g.X_BG));
  if (s.half_space) return start + "type='plane' size='1 1 1'/>\n";
  switch (g.shape) {
    case Shape::sphere:
      return start + fmt::format("type='sphere' size='{:.17g}'/>\n", g.size[0]);
    case Shape::box:
      return start + fmt::format("type='box' size='{}'/>\n", text(0.5 * g.size));
    case Shape::mesh:
      return start + fmt::format("type='mesh' mesh='{}'/>\n", name);
    default:
      return start + fmt::format("type='{}' size='{:.17g} {:.17g}'/>\n",
                                 g.shape == Shape::capsule ? "capsule" : "cylinder", g.size[0], 0.5 * g.size[1]);
  }
}

std::string sphere_on_axis(const std::string& name, const Geometry& g, double z) {
  Geometry sphere = g;
  sphere.shape = Shape::sphere;
  sphere.X_BG.p = g.X_BG * Vector3d{0, 0, z};
  return geom(name, {0, sphere});
}

std::string vertices(const EngineSurface& s) {
  std::string all;
  for (const Vector3d& v : s.geometry.mesh->vertices) {
    all += text({v[0] * s.geometry.size[0], v[1] * s.geometry.size[1], v[2] * s.geometry.size[2]}) + " ";
  }
  return all;
}

// Inserts text behind the tag that begins with `tag`.
void insert_behind(std::string& xml, const std::string& tag, const std::string& inserted) {
  const std::size_t at = xml.find(tag);
  if (at == std::string::npos) throw std::logic_error("MujocoContacts: no " + tag);
  xml.insert(xml.find('>', at) + 1, "\n" + inserted);
}

// The model with geoms g0, g1, ... of the surfaces and spheres g0:0, g0:1, ... of capsules, and the pairs of geoms.
std::string mjcf_with_contacts(const Model& model, const std::vector<EngineSurface>& surfaces,
                               const std::vector<SurfacePair>& pairs, int side_spheres) {
  std::string xml = mjcf(model), assets, list;
  const auto add = [&](const EngineSurface& s, const std::string& text_of_geom) {
    insert_behind(xml, s.body < 0 ? "<worldbody" : "<body name='" + model.bodies()[s.body].description.name + "'",
                  text_of_geom);
  };
  std::vector<bool> has_spheres(surfaces.size(), false);
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const std::string name = fmt::format("g{}", i);
    add(surfaces[i], geom(name, surfaces[i]));
    if (surfaces[i].geometry.shape == Shape::mesh)
      assets += fmt::format("<mesh name='{}' vertex='{}'/>\n", name, vertices(surfaces[i]));
  }
  for (const SurfacePair& pair : pairs) {
    const EngineSurface& first = surfaces[pair.a];
    const std::vector<Part> parts = parts_of(first, side_spheres);
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const bool is_sphere = parts.size() == 1;
      const std::string name = is_sphere ? fmt::format("g{}", pair.a) : fmt::format("g{}:{}", pair.a, k);
      if (!is_sphere && !has_spheres[pair.a]) add(first, sphere_on_axis(name, first.geometry, parts[k].z));
      list += fmt::format("<pair geom1='{}' geom2='g{}' condim='1'/>\n", name, pair.b);
    }
    has_spheres[pair.a] = true;
  }
  insert_behind(xml, "<mujoco", "<size nconmax='1000' njmax='1000'/>\n<asset>\n" + assets + "</asset>\n");
  xml.insert(xml.rfind("</mujoco>"), "<contact>\n" + list + "</contact>\n");
  return xml;
}

// Of a sphere against another shape (23.4).
double hertz_radius(double r, const EngineSurface& other) {
  const double q = other.geometry.size[0];
  if (other.half_space || other.geometry.shape == Shape::box || other.geometry.shape == Shape::mesh) return r;
  return other.geometry.shape == Shape::sphere ? r * q / (r + q) : std::sqrt(r * (r * q / (r + q)));
}

}  // namespace

// The nearest point of the plane if it is inside of the triangle, otherwise that of the edges.
Vector3d to_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d normal = cross(b - a, c - a);
  const Vector3d corners[3] = {a, b, c};
  const double area = dot(normal, normal);
  bool inside = area > 0;
  Vector3d nearest = a - p;
  for (int k = 0; k < 3; ++k) {
    const Vector3d &from = corners[k], edge = corners[(k + 1) % 3] - from;
    inside = inside && dot(cross(edge, p - from), normal) >= 0;
    const double along = dot(edge, edge) > 0 ? std::clamp(dot(p - from, edge) / dot(edge, edge), 0.0, 1.0) : 0.0;
    const Vector3d to = from + along * edge - p;
    if (dot(to, to) < dot(nearest, nearest)) nearest = to;
  }
  return inside ? (dot(a - p, normal) / area) * normal : nearest;
}

Vector3d to_hull(const Vector3d& p, const std::vector<Vector3d>& vertices) {
  Vector3d nearest = vertices[0] - p;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    for (std::size_t j = i + 1; j < vertices.size(); ++j) {
      for (std::size_t k = j + 1; k < vertices.size(); ++k) {
        const Vector3d to = to_triangle(p, vertices[i], vertices[j], vertices[k]);
        if (dot(to, to) < dot(nearest, nearest)) nearest = to;
      }
    }
  }
  return nearest;
}

MujocoContacts::MujocoContacts(const Model& model, const std::vector<EngineSurface>& surfaces,
                               const std::vector<SurfacePair>& pairs, const Settings& settings)
    : grapnel_(model),
      surfaces_(surfaces),
      pairs_(pairs),
      settings_(settings),
      model_(load_mjcf(mjcf_with_contacts(model, surfaces, pairs, settings.side_spheres))),
      data_(mj_makeData(model_)),
      link_of_geoms_(static_cast<std::size_t>(model_->ngeom * model_->ngeom), -1),
      forces_(pairs.size()),
      impulses_(pairs.size()) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::vector<Part> parts = parts_of(surfaces[pairs[i].a], settings.side_spheres);
    const int second = mj_name2id(model_, mjOBJ_GEOM, fmt::format("g{}", pairs[i].b).c_str());
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const std::string name =
          parts.size() == 1 ? fmt::format("g{}", pairs[i].a) : fmt::format("g{}:{}", pairs[i].a, k);
      const int first = mj_name2id(model_, mjOBJ_GEOM, name.c_str());
      link_of_geoms_[first * model_->ngeom + second] = link_of_geoms_[second * model_->ngeom + first] =
          static_cast<int>(links_.size());
      links_.push_back({i, parts[k].share});
    }
    radius_.push_back(hertz_radius(surfaces[pairs[i].a].geometry.size[0], surfaces[pairs[i].b]));
  }
  for (const Body& body : model.bodies()) {
    const int own = mj_name2id(model_, mjOBJ_BODY, body.description.name.c_str());
    const bool moves = model_->body_jntnum[own] > 0;
    const int joint = model_->body_jntadr[own];
    places_.push_back({moves ? model_->jnt_qposadr[joint] : -1, moves ? model_->jnt_dofadr[joint] : -1});
  }
  model_->opt.timestep = settings.step;
  model_->opt.integrator = mjINT_RK4;
  model_->opt.disableflags = mjDSBL_ACTUATION | mjDSBL_SENSOR | mjDSBL_WARMSTART | mjDSBL_GRAVITY;
  // Of the collision detection for meshes.
  model_->opt.mpr_tolerance = 1e-14, model_->opt.mpr_iterations = 1000;
  set_solver_parameters();
}

MujocoContacts::~MujocoContacts() {
  if (active == this) active = nullptr;
  mj_deleteData(data_);
  mj_deleteModel(model_);
}

// With a gap, contacts are detected but are no constraints.
void MujocoContacts::set_solver_parameters() {
  model_->opt.tolerance = 0, model_->opt.iterations = 20;
  for (int p = 0; p < model_->npair; ++p) {
    const int first = model_->pair_geom1[p], second = model_->pair_geom2[p];
    const Link& link = links_[link_of_geoms_[first * model_->ngeom + second]];
    const double inverse_mass = model_->body_invweight0[2 * model_->geom_bodyid[first]] +
                                model_->body_invweight0[2 * model_->geom_bodyid[second]];
    model_->pair_gap[p] = settings_.route == Route::solver ? 0 : 1e3;
    double* solref = model_->pair_solref + mjNREF * p;
    solref[0] = -pairs_[link.pair].law.elastic * link.share * inverse_mass, solref[1] = 0;
    double* solimp = model_->pair_solimp + mjNIMP * p;
    solimp[0] = solimp[1] = settings_.impedance, solimp[2] = 1e-3, solimp[3] = 0.5, solimp[4] = 2;
  }
}

const MujocoContacts::Link* MujocoContacts::link_of(int geom_1, int geom_2) const {
  const int link = link_of_geoms_[geom_1 * model_->ngeom + geom_2];
  return link < 0 ? nullptr : &links_[link];
}

// (23.4), (23.5) without damping.
double MujocoContacts::force(const Link& link, double depth, double approach_speed) const {
  const ContactLaw& law = pairs_[link.pair].law;
  const double elastic = law.hertz ? 4.0 / 3 * law.elastic * std::sqrt(radius_[link.pair]) * std::pow(depth, 1.5)
                                   : link.share * law.elastic * depth;
  return std::max(0.0, elastic * (1 + law.dissipation * approach_speed));
}

// Sphere and mesh => distance, normal and point of their contact.
void MujocoContacts::refine(mjContact& c) {
  const bool first_is_mesh = model_->geom_type[c.geom1] == mjGEOM_MESH;
  const int mesh = first_is_mesh ? c.geom1 : c.geom2, sphere = first_is_mesh ? c.geom2 : c.geom1;
  if (model_->geom_type[mesh] != mjGEOM_MESH) return;
  const EngineSurface& surface = surfaces_[pairs_[link_of(mesh, sphere)->pair].b];
  const int body = model_->geom_bodyid[mesh];
  const double* q = data_->xquat + 4 * body;
  const Posed X_WB{rotation_matrix(Quaterniond{q[0], q[1], q[2], q[3]}), vector_of(data_->xpos + 3 * body)};
  const Posed X_WG = X_WB * surface.geometry.X_BG;
  const Vector3d center = vector_of(data_->geom_xpos + 3 * sphere);
  const Vector3d to = X_WG.R * to_hull(transposed_times(X_WG.R, center - X_WG.p), surface.geometry.mesh->vertices);
  const double distance = norm(to), radius = model_->geom_size[3 * sphere];
  const Vector3d n = (1 / distance) * to, middle = center + 0.5 * (radius + distance) * n;
  mesh_depth_error_ = std::max(mesh_depth_error_, std::abs(c.dist - (distance - radius)));
  c.dist = distance - radius;
  for (int k = 0; k < 3; ++k) c.frame[k] = first_is_mesh ? -n[k] : n[k], c.pos[k] = middle[k];
}

// MuJoCo's contacts => forces on both bodies, as its passive forces.
void MujocoContacts::apply(const mjModel* model, mjData* data) {
  if (active == nullptr) return;
  ++active->evaluations_;
  if (active->settings_.route == Route::solver) return;
  std::fill(active->forces_.begin(), active->forces_.end(), Vector3d::zero());
  for (int i = 0; i < data->ncon; ++i) {
    mjContact& c = data->contact[i];
    const Link* link = active->link_of(c.geom1, c.geom2);
    if (link == nullptr || c.dist >= 0) continue;
    active->refine(c);
    if (c.dist >= 0) continue;
    // Velocity of a body's point along the normal, which points from geom1 to geom2.
    const auto speed = [&](int body) {
      const double* origin = data->subtree_com + 3 * model->body_rootid[body];
      const double* V = data->cvel + 6 * body;  // [angular; linear at origin]
      const Vector3d r = vector_of(c.pos) - vector_of(origin);
      const Vector3d v = vector_of(V + 3) + cross(vector_of(V), r);
      return dot(v, vector_of(c.frame));
    };
    const int first = model->geom_bodyid[c.geom1], second = model->geom_bodyid[c.geom2];
    const double f = active->force(*link, -c.dist, speed(first) - speed(second));
    const double on_second[3] = {f * c.frame[0], f * c.frame[1], f * c.frame[2]};
    const double on_first[3] = {-on_second[0], -on_second[1], -on_second[2]}, no_torque[3] = {0, 0, 0};
    mj_applyFT(model, data, on_first, no_torque, c.pos, first, data->qfrc_passive);
    mj_applyFT(model, data, on_second, no_torque, c.pos, second, data->qfrc_passive);
    active->forces_[link->pair] += f * vector_of(c.frame);
  }
}

// Forces of the solver in the present state => forces_.
void MujocoContacts::measure() {
  if (settings_.route == Route::user_forces) return;
  std::fill(forces_.begin(), forces_.end(), Vector3d::zero());
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& c = data_->contact[i];
    const Link* link = link_of(c.geom1, c.geom2);
    if (link != nullptr && c.efc_address >= 0)
      forces_[link->pair] += data_->efc_force[c.efc_address] * vector_of(c.frame);
  }
}

// A free joint's velocity is [linear in W; angular in B].
void MujocoContacts::start(const State& state) {
  mj_resetData(model_, data_);
  std::fill(impulses_.begin(), impulses_.end(), 0.0);
  mesh_depth_error_ = 0, evaluations_ = 0;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Body& body = grapnel_.bodies()[i];
    const JointType type = body.description.joint.type;
    const Place& at = places_[i];
    for (int k = 0; k < coordinate_count(type); ++k) data_->qpos[at.q + k] = state.q[body.q + k];
    for (int k = 0; k < velocity_count(type); ++k) data_->qvel[at.v + k] = state.v[body.v + k];
    if (type != JointType::free) continue;
    const Vector3d linear = root_twist(grapnel_, state, static_cast<int>(i)).linear;
    for (int k = 0; k < 3; ++k) data_->qvel[at.v + k] = linear[k], data_->qvel[at.v + 3 + k] = state.v[body.v + k];
  }
}

void MujocoContacts::run(double duration) {
  active = this;
  mjcb_passive = apply;
  const double step = model_->opt.timestep;
  const auto add_forces = [&](double weight) {
    mj_forward(model_, data_);
    measure();
    for (std::size_t i = 0; i < impulses_.size(); ++i) impulses_[i] += weight * norm(forces_[i]);
  };
  const long steps = std::lround(duration / step);
  for (long k = 0; k < steps; ++k) {
    add_forces(k == 0 ? 0.5 * step : step);
    mj_RungeKutta(model_, data_, 4);
  }
  add_forces(0.5 * step);
  active = nullptr;
}

State MujocoContacts::state() const {
  State state = zero_state(grapnel_);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Body& body = grapnel_.bodies()[i];
    const JointType type = body.description.joint.type;
    const Place& at = places_[i];
    std::copy_n(data_->qpos + at.q, coordinate_count(type), state.q.begin() + body.q);
    std::copy_n(data_->qvel + at.v, velocity_count(type), state.v.begin() + body.v);
    if (type != JointType::free) continue;
    const Rotationd R = root_pose(grapnel_, state, static_cast<int>(i)).R;
    const double* v = data_->qvel + at.v;
    set_root_twist(grapnel_, static_cast<int>(i), {R * Vector3d{v[3], v[4], v[5]}, {v[0], v[1], v[2]}}, state);
  }
  return state;
}

}  // namespace grapnel::testing
