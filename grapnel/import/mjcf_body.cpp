#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "grapnel/import/mjcf_model.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// The first is the default type of a geom.
constexpr std::array kGeomTypes{"sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "plane", "hfield", "sdf"};

// A geom of any type, sizes as MuJoCo has them: radius; radius and half length; half edges or half axes.
struct MjcfGeom {
  std::string type;
  std::array<double, 3> size{};
  Posed X_BG = Posed::identity();
  bool is_fitted = false;  // a primitive whose size comes from a mesh
  bool is_sound = true;    // false after a fault
};

bool is_primitive(const std::string& type) {
  return type == "sphere" || type == "capsule" || type == "ellipsoid" || type == "cylinder" || type == "box";
}

// How many sizes a primitive has; two points stand for its length.
std::size_t size_count(const std::string& type, bool between_points) {
  if (type == "sphere") return 1;
  if (type == "capsule" || type == "cylinder") return between_points ? 1 : 2;
  return between_points ? 1 : 3;
}

// From two points: half their distance takes the place of the last size.
void size_between_points(const MjcfPart& part, MjcfGeom& geom, MjcfContext& context) {
  if (geom.type == "sphere" || !is_primitive(geom.type)) {
    context.fault(
        part.attributes.mark("fromto"),
        fmt::format("fromto of <geom>: not supported for a {}; use capsule, cylinder, box or ellipsoid", geom.type));
    geom.is_sound = false;
    return;
  }
  const auto points = part.attributes.numbers("fromto", 6, context.faults);
  if (!points) {
    geom.is_sound = false;
    return;
  }
  const auto& p = *points;
  const double half = norm(Vector3d{p[0] - p[3], p[1] - p[4], p[2] - p[5]}) / 2;
  if (geom.type == "capsule" || geom.type == "cylinder") {
    geom.size[1] = half;
  } else {
    geom.size[2] = half;
    geom.size[1] = geom.size[0];
  }
}

MjcfGeom read_geom(const MjcfPart& part, MjcfContext& context) {
  const MjcfAttributes& given = part.attributes;
  MjcfGeom geom;
  geom.type = given.word("type", kGeomTypes, context.faults);
  geom.X_BG = mjcf_place(part, context);
  geom.is_fitted = is_primitive(geom.type) && given.source("mesh") != nullptr;
  if (!is_primitive(geom.type) || geom.is_fitted) return geom;
  const std::vector<double> size = given.overlaid("size", {0, 0, 0}, context.faults);
  std::copy(size.begin(), size.end(), geom.size.begin());
  const bool between_points = given.source("fromto") != nullptr;
  const std::size_t count = size_count(geom.type, between_points);
  if (between_points) size_between_points(part, geom, context);
  for (std::size_t i = 0; i < count && geom.is_sound; ++i) {
    if (geom.size[i] > 0) continue;
    context.fault(given.mark("size"), fmt::format("size of a <geom> of type {} needs {} above 0, found {}", geom.type,
                                                  counted(count, "number"), geom.size[i]));
    geom.is_sound = false;
  }
  return geom;
}

double volume_of(const MjcfGeom& geom) {
  const auto& [a, b, c] = geom.size;
  if (geom.type == "sphere") return 4.0 / 3 * M_PI * a * a * a;
  if (geom.type == "capsule") return M_PI * a * a * (2 * b + 4.0 / 3 * a);
  if (geom.type == "cylinder") return M_PI * a * a * 2 * b;
  if (geom.type == "ellipsoid") return 4.0 / 3 * M_PI * a * b * c;
  if (geom.type == "box") return 8 * a * b * c;
  return 0;
}

// Of a solid of uniform density about its centre, in its own axes.
Symmetric3d solid_inertia(const MjcfGeom& geom, double mass) {
  const auto& [a, b, c] = geom.size;
  if (geom.type == "sphere") return Symmetric3d::diagonal(0.4 * mass * a * a, 0.4 * mass * a * a, 0.4 * mass * a * a);
  if (geom.type == "ellipsoid" || geom.type == "box") {
    const double share = mass / (geom.type == "box" ? 3 : 5);
    return Symmetric3d::diagonal(share * (b * b + c * c), share * (a * a + c * c), share * (a * a + b * b));
  }
  const double length = 2 * b;
  if (geom.type == "cylinder") {
    const double across = mass * (3 * a * a + length * length) / 12;
    return Symmetric3d::diagonal(across, across, mass * a * a / 2);
  }
  // A capsule: a cylinder and two half spheres, whose centres of mass are 3/8 a beyond the cylinder's ends.
  const double caps = mass * 4 * a / (4 * a + 3 * length), middle = mass - caps;
  const double across =
      middle * (3 * a * a + length * length) / 12 + caps * (0.4 * a * a + length * length / 4 + 3 * a * length / 8);
  return Symmetric3d::diagonal(across, across, middle * a * a / 2 + caps * 0.4 * a * a);
}

// A mesh with what is within it; empty, with the reason, if MuJoCo's inertia of it is not known.
struct SolidMesh {
  const MjcfMesh* mesh;
  MeshSolid solid;
};
std::optional<SolidMesh> solid_of(const MjcfPart& part, const MjcfGeom& geom, MjcfContext& context,
                                  std::string& why_not) {
  const auto found = context.meshes.find(part.attributes.text("mesh"));
  if (geom.type != "mesh" || found == context.meshes.end()) {
    why_not = geom.is_fitted ? "to which a primitive is fitted" : "which is not supported";
    return {};
  }
  const MjcfMesh& mesh = found->second;
  if (!mesh.unusable.empty() || !mesh.other_inertia.empty()) {
    why_not = !mesh.unusable.empty() ? "but " + mesh.unusable
                                     : fmt::format("as of inertia=\"{}\", which is not supported", mesh.other_inertia);
    return {};
  }
  std::string fault;
  const auto triangles = context.read_mesh ? context.read_mesh(context.folder / mesh.file, fault) : nullptr;
  if (!triangles) {
    why_not = fault.empty() ? "which is not supported" : "but " + fault;
    return {};
  }
  const auto solid = solid_within(*triangles, mesh.scale);
  if (solid && (solid->is_star || mesh.is_exact || context.compiler.exact_meshes)) return SolidMesh{&mesh, *solid};
  why_not = solid ? "whose hollows count as mass in MuJoCo, unless <compiler> has exactmeshinertia=\"true\" (since "
                    "3.2.5: inertia=\"exact\" at <mesh>)"
                  : "whose triangles do not close a volume";
  return {};
}

// Mass and inertia of a geom in the body's frame. `amount`: its mass, or its density. Empty, with a message, if they
// are unknown.
RigidBodyInertiad inertia_of_geom(const MjcfBody& body, const MjcfPart& part, const MjcfGeom& geom, bool is_mass,
                                  double amount, MjcfContext& context) {
  if (is_primitive(geom.type) && !geom.is_fitted) {
    const double mass = is_mass ? amount : amount * volume_of(geom);
    return geom.X_BG * RigidBodyInertiad::about_com(mass, Vector3d::zero(), solid_inertia(geom, mass));
  }
  std::string why_not;
  if (const auto found = solid_of(part, geom, context, why_not)) {
    const MeshSolid& solid = found->solid;
    const double density = is_mass ? amount / solid.volume : amount;
    const Symmetric3d& I = solid.inertia;
    const Symmetric3d inertia{density * I.xx, density * I.yy, density * I.zz,
                              density * I.xy, density * I.xz, density * I.yz};
    return geom.X_BG * found->mesh->X_GM * RigidBodyInertiad::about_com(density * solid.volume, solid.com, inertia);
  }
  const Mark mark = part.attributes.mark("mesh");
  if (body.moves) {
    context.fault(mark, fmt::format("the inertia of body {} would come from a mesh, {}: give the body an <inertial> "
                                    "(MuJoCo computes one and writes it when it saves the model), or the geom "
                                    "mass=\"0\"",
                                    in_quotes(body.name), why_not));
  } else {
    context.decide(mark,
                   fmt::format("body {} does not move in the file, and its mass would come from a mesh, {}: it is "
                               "ignored; add an <inertial> to state it",
                               in_quotes(body.name), why_not),
                   body.name);
  }
  return RigidBodyInertiad::zero();
}

// Mass and inertia of the body's geoms in its frame.
RigidBodyInertiad inertia_of_geoms(const MjcfBody& body, MjcfContext& context) {
  RigidBodyInertiad total = RigidBodyInertiad::zero();
  for (const MjcfPart& part : body.geoms) {
    const MjcfAttributes& given = part.attributes;
    const double group = given.number("group", context.faults).value_or(0);
    if (group < context.compiler.first_group || group > context.compiler.last_group) continue;
    const auto mass = given.number("mass", context.faults), density = given.number("density", context.faults);
    const char* named = mass ? "mass" : "density";
    const double amount = mass ? *mass : density.value_or(1000);
    if (amount < 0)
      context.fault(given.mark(named), fmt::format("{} of <geom> is {}, expected 0 or more", named, amount));
    if (!(amount > 0)) continue;
    const MjcfGeom geom = read_geom(part, context);
    if (!geom.is_sound || geom.type == "plane" || geom.type == "hfield") continue;
    // A missing mesh is reported by the reader of shapes.
    if (geom.type == "mesh" && !context.meshes.contains(given.text("mesh"))) continue;
    if (given.flag("shellinertia", false, context.faults)) {
      context.fault(given.mark("shellinertia"),
                    fmt::format("shellinertia is not supported: give body {} an <inertial>", in_quotes(body.name)));
      continue;
    }
    total += inertia_of_geom(body, part, geom, mass.has_value(), amount, context);
  }
  return total;
}

// <inertial>, in the body's axes.
SourceInertia inertia_of_element(const MjcfPart& part, MjcfContext& context) {
  const MjcfAttributes& given = part.attributes;
  FaultList& faults = context.faults;
  SourceInertia result{given.element().mark(), 0, Vector3d::zero(), Symmetric3d::zero()};
  const auto required = [&](const char* attribute) {
    if (given.source(attribute) == nullptr)
      context.fault(given.element().mark(), fmt::format("<inertial> has no {}", in_quotes(attribute)));
  };
  required("pos"), required("mass");
  const Posed X = part.X_BF * mjcf_pose(given, context.compiler, faults);
  result.com = X.p;
  result.mass = given.number("mass", faults).value_or(0);
  if (result.mass < 0) context.fault(given.mark("mass"), fmt::format("mass of <inertial> is {}", result.mass));
  const bool diagonal = given.source("diaginertia") != nullptr, full = given.source("fullinertia") != nullptr;
  if (diagonal == full) {
    context.fault(given.mark(full ? "fullinertia" : "diaginertia"),
                  fmt::format("<inertial> has {} diaginertia {} fullinertia; give one of them",
                              full ? "both" : "neither", full ? "and" : "nor"));
    return result;
  }
  if (diagonal) {
    const Vector3d d = given.vector("diaginertia", faults).value_or(Vector3d::zero());
    result.inertia = rotate(X.R, Symmetric3d::diagonal(d[0], d[1], d[2]));
    return result;
  }
  for (const char* turned : {"quat", "axisangle", "xyaxes", "zaxis", "euler"}) {
    if (given.source(turned) == nullptr) continue;
    context.fault(given.mark(turned),
                  fmt::format("{} of <inertial>: fullinertia is in the axes of the body and excludes "
                              "an orientation",
                              turned));
  }
  if (const auto m = given.numbers("fullinertia", 6, faults))
    result.inertia = rotate(part.X_BF.R, Symmetric3d{(*m)[0], (*m)[1], (*m)[2], (*m)[3], (*m)[4], (*m)[5]});
  return result;
}

std::string three(const Eigen::VectorXd& m) { return fmt::format("{:.6g}, {:.6g}, {:.6g}", m[0], m[1], m[2]); }

// The compiler's minimum mass and moments, and balanced moments.
void apply_bounds(const MjcfBody& body, SourceInertia& inertia, MjcfContext& context) {
  const MjcfCompiler& compiler = context.compiler;
  if (inertia.mass < compiler.least_mass) {
    context.decide(inertia.mark,
                   fmt::format("body {}: boundmass makes its mass {:.6g} kg instead of {:.6g} kg", in_quotes(body.name),
                               compiler.least_mass, inertia.mass),
                   body.name);
    inertia.mass = compiler.least_mass;
  }
  if (!(compiler.least_inertia > 0) && !compiler.balance_inertia) return;
  Eigen::MatrixXd matrix(3, 3);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) matrix(i, j) = inertia.inertia(i, j);
  }
  if (!matrix.allFinite()) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  const Eigen::VectorXd found = solver.eigenvalues();
  Eigen::VectorXd moments = found.cwiseMax(compiler.least_inertia);
  // Tolerance for rounding: MuJoCo checks the moments as written.
  const double largest = moments.maxCoeff();
  if (compiler.balance_inertia && moments.sum() - largest < largest * (1 - 1e-12)) moments.setConstant(moments.mean());
  if (moments == found) return;
  context.decide(
      inertia.mark,
      fmt::format("body {}: {} makes its principal moments {} kg m^2 instead of {} kg m^2", in_quotes(body.name),
                  compiler.balance_inertia ? "boundinertia or balanceinertia" : "boundinertia", three(moments),
                  three(found)),
      body.name);
  const Eigen::MatrixXd& axes = solver.eigenvectors();
  const Eigen::MatrixXd bounded = axes * moments.asDiagonal() * axes.transpose();
  inertia.inertia = {bounded(0, 0), bounded(1, 1), bounded(2, 2), bounded(0, 1), bounded(0, 2), bounded(1, 2)};
}

bool is_finite(const Symmetric3d& m) { return std::isfinite(m.xx + m.yy + m.zz) && std::isfinite(m.xy + m.xz + m.yz); }

// The shape of a mesh geom; empty, with a message, if its triangles are not available.
std::optional<SourceShape> mesh_shape(const MjcfPart& part, const MjcfGeom& geom, MjcfContext& context) {
  const std::string name = part.attributes.text("mesh");
  const auto found = context.meshes.find(name);
  if (found == context.meshes.end()) {
    std::vector<std::string> names;
    for (const auto& [known, mesh] : context.meshes) names.push_back(known);
    context.fault(part.attributes.mark("mesh"),
                  fmt::format("there is no mesh {} in <asset>{}", in_quotes(name), suggestion(name, names, "meshes")));
    return std::nullopt;
  }
  const MjcfMesh& mesh = found->second;
  if (!mesh.unusable.empty()) {
    context.passed_over.element(part.element(), "shape omitted: " + mesh.unusable);
    return std::nullopt;
  }
  SourceShape shape{part.element().mark(), {}, mesh.file, false};
  shape.shape = {Geometry::Shape::mesh, mesh.scale, geom.X_BG * mesh.X_GM, nullptr};
  return shape;
}

std::optional<SourceShape> shape_of(const MjcfPart& part, MjcfContext& context) {
  const MjcfGeom geom = read_geom(part, context);
  if (!geom.is_sound) return std::nullopt;
  if (geom.type == "mesh") return mesh_shape(part, geom, context);
  if (!is_primitive(geom.type) || geom.is_fitted) {
    context.passed_over.element(
        part.element(),
        fmt::format("shape omitted: Grapnel has no {}", geom.is_fitted ? "primitives fitted to meshes" : geom.type));
    return std::nullopt;
  }
  const auto& [a, b, c] = geom.size;
  SourceShape shape{part.element().mark(), {}, {}, false};
  shape.shape.X_BG = geom.X_BG;
  if (geom.type == "sphere") {
    shape.shape.shape = Geometry::Shape::sphere, shape.shape.size = {a, 0, 0};
  } else if (geom.type == "capsule") {
    shape.shape.shape = Geometry::Shape::capsule, shape.shape.size = {a, 2 * b, 0};
  } else if (geom.type == "cylinder") {
    shape.shape.shape = Geometry::Shape::cylinder, shape.shape.size = {a, 2 * b, 0};
  } else {
    shape.shape.shape = Geometry::Shape::box, shape.shape.size = {2 * a, 2 * b, 2 * c};
    if (geom.type == "ellipsoid") {
      context.passed_over.element(part.element(), "an ellipsoid is replaced by its bounding box as a shape");
    }
  }
  return shape;
}

}  // namespace

Posed mjcf_place(const MjcfPart& part, MjcfContext& context) {
  const MjcfAttributes& given = part.attributes;
  if (given.source("fromto") == nullptr) return part.X_BF * mjcf_pose(given, context.compiler, context.faults);
  const auto points = given.numbers("fromto", 6, context.faults);
  if (!points) return part.X_BF;
  const auto& p = *points;
  const Vector3d from{p[0], p[1], p[2]}, to{p[3], p[4], p[5]};
  if (!(norm(from - to) > 1e-14)) {
    context.fault(given.mark("fromto"),
                  fmt::format("fromto of <{}>: the two points are the same", part.element().tag()));
    return part.X_BF;
  }
  if (given.source("pos") != nullptr) {
    const Vector3d pos = given.vector("pos", context.faults).value_or(Vector3d::zero());
    if (norm(pos) > 0)
      context.fault(given.mark("pos"), fmt::format("<{}> has both pos and fromto; give one", part.element().tag()));
  }
  // MuJoCo's z axis points from the second point to the first.
  return part.X_BF * Posed{mjcf_rotation_of_z(from - to), 0.5 * (from + to)};
}

std::optional<SourceInertia> read_mjcf_inertia(const MjcfBody& body, MjcfContext& context) {
  using From = MjcfCompiler::Inertia;
  const MjcfCompiler& compiler = context.compiler;
  if (body.inertials.size() > 1)
    context.fault(body.inertials[1].element().mark(), fmt::format("body {} has two <inertial>", in_quotes(body.name)));
  const bool has_element = !body.inertials.empty();
  const bool by_geoms =
      compiler.inertia == From::from_geoms || (compiler.inertia == From::from_geoms_where_missing && !has_element);
  // Without geoms in the chosen groups <inertial> stays, even if geoms are to give all inertias.
  const bool has_geoms = std::ranges::any_of(body.geoms, [&](const MjcfPart& part) {
    const double group = part.attributes.number("group", context.faults).value_or(0);
    return group >= compiler.first_group && group <= compiler.last_group;
  });
  SourceInertia result{body.element->mark(), 0, Vector3d::zero(), Symmetric3d::zero()};
  if (by_geoms && has_geoms) {
    const RigidBodyInertiad sum = inertia_of_geoms(body, context);
    result.mass = sum.mass;
    if (sum.mass > 0) result.com = sum.com(), result.inertia = sum.rotational_about_com();
    if (has_element)
      context.passed_over.element(body.inertials[0].element(), "replaced by the inertia of geoms (inertiafromgeom)");
  } else if (has_element) {
    result = inertia_of_element(body.inertials[0], context);
  }
  // MuJoCo places what has no centre of mass at the body's `pos`, though in the body's own frame.
  if (result.mass == 0 && !has_element && !(by_geoms && has_geoms)) result.com = body.X_PB.p;
  apply_bounds(body, result, context);
  const bool is_nothing =
      result.mass == 0 && result.inertia.xx == 0 && result.inertia.yy == 0 && result.inertia.zz == 0;
  if (is_nothing && !has_element) return std::nullopt;
  if (!std::isfinite(result.mass) || !is_finite(result.inertia) || !std::isfinite(norm(result.com))) {
    context.fault(result.mark, fmt::format("mass or inertia of body {} is not finite", in_quotes(body.name)));
    return std::nullopt;
  }
  return result;
}

std::vector<SourceShape> read_mjcf_shapes(const MjcfBody& body, MjcfContext& context) {
  std::vector<SourceShape> shapes;
  for (const MjcfPart& part : body.geoms) {
    const bool touches = part.attributes.number("contype", context.faults).value_or(1) != 0 ||
                         part.attributes.number("conaffinity", context.faults).value_or(1) != 0;
    if (auto shape = shape_of(part, context)) {
      shape->is_visual = !touches;
      shapes.push_back(std::move(*shape));
    }
  }
  return shapes;
}

}  // namespace grapnel
