#include "grapnel/problem/flexible_bodies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/problem/beam.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/cut_shapes.hpp"
#include "grapnel/problem/vibration_modes.hpp"

namespace grapnel {
namespace {

// For a link that consists only of its beam: remaining inertia of either sign below this fraction of the link's counts
// as zero, since numbers in files have some six digits.
constexpr double kNothing = 1e-6;

constexpr const char* kDrive = "drive:";  // prefix of the body that a link's motor turns
constexpr const char* kGear = "gear:";    // prefix of a joint's name: the spring of its gear

Symmetric3d operator-(const Symmetric3d& a, const Symmetric3d& b) {
  return {a.xx - b.xx, a.yy - b.yy, a.zz - b.zz, a.xy - b.xy, a.xz - b.xz, a.yz - b.yz};
}

double size_of(const Symmetric3d& I) { return std::abs(I.xx) + std::abs(I.yy) + std::abs(I.zz); }

// A link without its beam, about the rest's own centre of mass.
struct Rest {
  double mass = 0;
  Vector3d com = Vector3d::zero();
  Symmetric3d inertia = Symmetric3d::zero();
  bool is_nothing = false;  // no mass: the inertia is about the beam's middle, and is distributed over all pieces
};

Rest rest_of(const BodyDescription& link, const Beam& beam) {
  const RigidBodyInertiad whole = RigidBodyInertiad::about_com(link.mass, link.com, link.inertia), rod = beam.inertia();
  Rest rest;
  rest.mass = link.mass - beam.mass();
  if (rest.mass == 0) {
    rest.is_nothing = true, rest.com = beam.com();
    rest.inertia = link.inertia - rod.rotational_about_com();
    // Removes rounding errors relative to a slender rod's inertia.
    for (double* moment : {&rest.inertia.xx, &rest.inertia.yy, &rest.inertia.zz}) {
      if (std::abs(*moment) <= kNothing * size_of(link.inertia)) *moment = 0;
    }
    return rest;
  }
  const RigidBodyInertiad left{rest.mass, whole.first_moment - rod.first_moment, whole.rotational - rod.rotational};
  rest.com = left.com();
  rest.inertia = left.rotational_about_com();
  return rest;
}

// --- Pieces ---

std::string piece_name(const std::string& link, int piece) {
  return piece == 0 ? link : fmt::format("{}:{}", link, piece);
}

// The parts of a shape that extends along the beam, one for each of its pieces; no parts of other shapes.
CutShape cut(const Geometry& shape, const std::string& link, const Beam& beam) {
  const Posed& X = shape.X_BG;
  CutShape all{shape, beam.at(0), beam.x(), {}};
  int axis = -1;
  double length = 0;
  if (shape.shape == Geometry::Shape::box) {
    for (int k = 0; k < 3; ++k) {
      if (std::abs(dot(X.R.column(k), beam.x())) > 1 - 1e-9) axis = k, length = shape.size[k];
    }
  } else if (shape.shape == Geometry::Shape::cylinder || shape.shape == Geometry::Shape::capsule) {
    if (std::abs(dot(X.R.column(2), beam.x())) > 1 - 1e-9) axis = 2, length = shape.size[1];
  }
  const double middle = dot(beam.x(), X.p - beam.at(0));
  const double first = middle - 0.5 * length, last = middle + 0.5 * length;
  const int begin = beam.piece_of(beam.at(first)), end = beam.piece_of(beam.at(last));
  if (axis < 0 || begin == end) return all;
  for (int piece = begin; piece <= end; ++piece) {
    const double from = piece == begin ? first : beam.begin(piece), to = piece == end ? last : beam.end(piece);
    if (!(to > from)) continue;
    Geometry part = shape;
    part.X_BG.p = X.p + (0.5 * (from + to) - middle) * beam.x() - beam.origin(piece);
    part.size[shape.shape == Geometry::Shape::box ? axis : 1] = to - from;
    all.pieces.push_back(
        {piece_name(link, piece), beam.origin(piece), beam.begin(piece), beam.end(piece), std::move(part)});
  }
  return all;
}

// The parts of a shape on their pieces; a shape without parts is on the piece with its centre.
void add_parts(const Geometry& shape, const std::string& link, const Beam& beam,
               std::vector<std::pair<std::string, Geometry>>& out) {
  CutShape parts = cut(shape, link, beam);
  for (CutShape::Piece& piece : parts.pieces) out.emplace_back(std::move(piece.body), std::move(piece.part));
  if (!parts.pieces.empty()) return;
  const int piece = beam.piece_of(shape.X_BG.p);
  Geometry whole = shape;
  whole.X_BG.p = whole.X_BG.p - beam.origin(piece);
  out.emplace_back(piece_name(link, piece), std::move(whole));
}

RigidBodyInertiad less(const RigidBodyInertiad& whole, const RigidBodyInertiad& part) {
  return {whole.mass - part.mass, whole.first_moment - part.first_moment, whole.rotational - part.rotational};
}

// --- Modes of a link ---

// A kind of bending, named as in Beam::Hinge, and its name in messages.
struct Kind {
  char name;
  const char* words;
};
constexpr Kind kKinds[] = {{'y', "bending about y"}, {'z', "bending about z"}, {'a', "stretching"}, {'x', "twisting"}};

struct LinkMode {
  const Kind* kind;
  int number;  // of its kind, from 1
  ElasticMode vibration;
};

// The slowest modes of a link of pieces, at most `count` of each kind: clamped at its joint, with the bodies that hang
// on the link as rigid bodies, at zero joint positions. `pieces` are the link's; the first carries the others. Shapes
// are over the joints of the pieces in their order.
std::vector<LinkMode> modes_of_link(const RobotSetup& robot, const BodyDescription& link,
                                    const std::vector<BodyDescription>& pieces, int count) {
  ModelBuilder builder;
  BodyDescription root = pieces.front();
  root.parent.clear(), root.joint = JointDescription{}, root.X_PF = Posed::identity(), root.part_of.clear();
  // fixed, so the values do not matter
  root.mass = 1, root.com = Vector3d::zero(), root.inertia = Symmetric3d::diagonal(1, 1, 1);
  builder.add(root);
  for (std::size_t i = 1; i < pieces.size(); ++i) builder.add(pieces[i]);
  std::vector<std::string> carried{link.name};
  for (BodyDescription body : rigid_robot(robot).bodies) {  // parents first
    if (std::find(carried.begin(), carried.end(), body.parent) == carried.end()) continue;
    carried.push_back(body.name);
    if (body.parent == link.name) {
      const PlaceOnPiece place = place_on_piece(link, body.X_PF.p);
      body.parent = place.body, body.X_PF.p = place.p;
    }
    body.joint.type = JointType::fixed;
    builder.add(body);
  }
  const Model model = std::move(builder).build();
  const State at_rest = zero_state(model);
  std::vector<LinkMode> modes;
  for (const Kind& kind : kKinds) {
    std::vector<int> others;
    for (const int body : model.springs()) {
      if (model.bodies()[body].description.joint.name.back() != kind.name) others.push_back(model.bodies()[body].v);
    }
    std::vector<ElasticMode> of_kind = elastic_modes(model, at_rest, others);
    for (int n = 0; n < std::min(count, static_cast<int>(of_kind.size())); ++n)
      modes.push_back({&kind, n + 1, std::move(of_kind[n])});
  }
  return modes;
}

BodyDescription without_beam(BodyDescription link) {
  link.beam.reset();
  return link;
}

// Pieces of a link, without modes: the link's own body, then the further pieces, with the joints between them.
std::vector<BodyDescription> pieces_on_springs(const BodyDescription& link, BodyDescription root) {
  Beam beam(link);
  const Rest rest = rest_of(link, beam);
  if (rest.is_nothing) beam.spread(rest.inertia);
  const auto set = [&](const RigidBodyInertiad& I, BodyDescription& body) {
    body.mass = I.mass, body.com = I.com(), body.inertia = I.rotational_about_com();
    body.part_of = link.name;
  };
  RigidBodyInertiad first = beam.piece_inertia(0);
  if (!rest.is_nothing) first += RigidBodyInertiad::about_com(rest.mass, rest.com, rest.inertia);
  set(first, root);
  std::vector<BodyDescription> pieces{std::move(root)};
  for (int piece = 1; piece <= beam.hinges(); ++piece) {
    std::string parent = piece_name(link.name, piece - 1);
    Vector3d at = beam.origin(piece) - beam.origin(piece - 1);
    const std::vector<Beam::Hinge> springs = beam.springs(piece - 1);
    for (const Beam::Hinge& hinge : springs) {
      BodyDescription body;
      const bool is_last = &hinge == &springs.back();
      body.joint.name = fmt::format("{}{}", piece_name(link.name, piece), hinge.name);
      body.name = is_last ? piece_name(link.name, piece) : body.joint.name;
      body.parent = parent, body.X_PF.p = at;
      body.joint.type = hinge.type, body.joint.axis = hinge.axis, body.joint.spring = hinge.spring;
      body.part_of = link.name;
      if (is_last) set(beam.piece_inertia(piece), body);
      parent = body.name, at = Vector3d::zero();
      pieces.push_back(std::move(body));
    }
  }
  return pieces;
}

// Expands a robot's bodies one by one, with the bodies that hang on them.
class Expansion {
 public:
  explicit Expansion(const RobotSetup& robot) : robot_(robot) {}

  RobotSetup result() {
    RobotSetup flexible = robot_;
    flexible.undeformed = std::make_shared<const RobotSetup>(robot_);
    flexible.bodies.clear(), flexible.geometry.clear();
    for (const BodyDescription& link : robot_.bodies) add(link, flexible);
    for (EndEffectorSetup& e : flexible.end_effectors) {
      const PlaceOnPiece place = placed(e.body, e.X_BE.p);
      e.body = place.body, e.X_BE.p = place.p;
    }
    return flexible;
  }

  PlaceOnPiece placed(const std::string& body, const Vector3d& p) const {
    const auto link = std::find_if(robot_.bodies.begin(), robot_.bodies.end(),
                                   [&](const BodyDescription& b) { return b.name == body; });
    return link == robot_.bodies.end() ? PlaceOnPiece{body, p} : place_on_piece(*link, p);
  }

 private:
  void add(const BodyDescription& link, RobotSetup& flexible) {
    BodyDescription body = link;
    body.beam.reset(), body.modes.clear();
    const PlaceOnPiece place = placed(link.parent, link.X_PF.p);
    body.parent = place.body, body.X_PF.p = place.p;
    if (link.joint.elasticity) {
      if (const std::string fault = gear_fault(link.joint); !fault.empty())
        throw std::invalid_argument(fmt::format("joint '{}': {}", link.joint.name, fault));
      add_gear(link, body, flexible);
    }
    if (link.beam) {
      if (const std::string fault = beam_fault(link); !fault.empty())
        throw std::invalid_argument(fmt::format("body '{}': {}", link.name, fault));
      add_pieces(link, std::move(body), flexible);
      return;
    }
    for (const auto& [name, shape] : robot_.geometry) {
      if (name == link.name) flexible.geometry.emplace_back(name, shape);
    }
    if (!link.modes.empty()) {
      if (const std::string fault = modes_fault(link); !fault.empty())
        throw std::invalid_argument(fmt::format("body '{}': {}", link.name, fault));
    }
    flexible.bodies.push_back(std::move(body));
    for (BodyDescription& part : bodies_of_modes(link)) flexible.bodies.push_back(std::move(part));
  }

  // The motor turns a massless body, which carries the link by a spring about the same axis (22.4).
  static void add_gear(const BodyDescription& link, BodyDescription& body, RobotSetup& flexible) {
    BodyDescription turned;
    turned.name = kDrive + link.name;
    turned.parent = body.parent, turned.X_PF = body.X_PF;
    turned.joint = link.joint;
    turned.joint.elasticity.reset();
    turned.part_of = link.name;
    body.parent = turned.name, body.X_PF = Posed::identity();
    body.joint = JointDescription{};
    body.joint.name = kGear + link.joint.name;
    body.joint.type = slides_along_axis(link.joint.type) ? JointType::prismatic : JointType::continuous;
    body.joint.axis = link.joint.axis;
    body.joint.spring = JointSpring{link.joint.elasticity->stiffness, link.joint.elasticity->damping, 0,
                                    link.joint.elasticity->backlash};
    flexible.bodies.push_back(std::move(turned));
  }

  void add_pieces(const BodyDescription& link, BodyDescription root, RobotSetup& flexible) {
    std::vector<BodyDescription> pieces = pieces_on_springs(link, std::move(root));
    if (link.beam->modes) {
      const std::vector<LinkMode> modes = modes_of_link(robot_, link, pieces, *link.beam->modes);
      for (std::size_t joint = 0; joint + 1 < pieces.size() && !modes.empty(); ++joint) {
        ModalJoint& own = pieces[joint + 1].joint.modal.emplace(ModalJoint{link.name, {}});
        for (const LinkMode& mode : modes) own.rates.push_back(mode.vibration.shape[joint]);
      }
    }
    for (BodyDescription& piece : pieces) flexible.bodies.push_back(std::move(piece));
    const Beam beam(link);
    for (const auto& [name, shape] : robot_.geometry) {
      if (name == link.name) add_parts(shape, link.name, beam, flexible.geometry);
    }
  }

  const RobotSetup& robot_;
};

}  // namespace

bool is_flexible(const RobotSetup& robot) {
  return std::any_of(robot.bodies.begin(), robot.bodies.end(), [](const BodyDescription& b) {
    return b.beam.has_value() || !b.modes.empty() || b.joint.elasticity.has_value() || b.joint.spring.has_value();
  });
}

std::string gear_fault(const JointDescription& joint) {
  if (!has_one_axis(joint.type)) return "only a joint with one axis can have a flexible gear";
  if (joint.spring) return "a joint with a spring is not driven, so it has no flexible gear";
  if (!(joint.reflected_inertia() > 0))
    return "a flexible gear needs rotor_inertia and gear_ratio: no other body between motor and spring "
           "has inertia";
  return {};
}

std::string beam_fault(const BodyDescription& link) {
  const BeamDescription& b = *link.beam;
  if (link.parent.empty()) return "the base cannot be a beam; make panels and masts links on it";
  if (std::string fault = description_fault(b); !fault.empty()) return fault;
  const double length = norm(b.to - b.from);
  Beam beam(link);
  const Rest rest = rest_of(link, beam);
  if (dot(beam.x(), b.from) < -1e-9 * length)
    return fmt::format(
        "the beam begins {:.6g} m before the link's joint: its beginning, from, must be at the joint or beyond it",
        -dot(beam.x(), b.from));
  if (rest.mass < 0)
    return fmt::format("the beam has {:.6g} kg, more than the {:.6g} kg of its link, whose mass includes it",
                       beam.mass(), link.mass);
  if (rest.is_nothing) {
    if (norm(link.com - rest.com) > 1e-6 * length)
      return fmt::format(
          "the beam is all of its link's mass, {:.6g} kg, so the link's centre of mass must be the beam's, ({:.6g}, "
          "{:.6g}, {:.6g}) m; otherwise the link's mass must be larger",
          beam.mass(), rest.com[0], rest.com[1], rest.com[2]);
    const Symmetric3d& I = rest.inertia;
    const double least = -kNothing * size_of(link.inertia);
    if (I.xx < least || I.yy < least || I.zz < least)
      return fmt::format(
          "the link's inertia is less than that of its beam, a slender rod of {:.6g} kg and {:.6g} m, which has {:.6g} "
          "kg m^2 about itself, {:.6g} about its section's y axis and {:.6g} about the z axis",
          beam.mass(), length, beam.inertia_along(), beam.inertia_y(), beam.inertia_z());
  } else if (const std::string fault = inertia_fault(rest.inertia); !fault.empty()) {
    return fmt::format(
        "the link's mass and inertia, less those of its beam, are not those of a rigid body; the beam is a slender rod "
        "of {:.6g} kg and {:.6g} m: {}",
        beam.mass(), length, fault);
  }
  if (rest.is_nothing) beam.spread(rest.inertia);
  if (beam.twists() && !beam.has_rotary_inertia())
    return rest.is_nothing ? "torsional_stiffness needs inertia about the beam's axis"
                           : "torsional_stiffness needs rotary_inertia: without it the beam's pieces have no inertia "
                             "about the beam's axis";
  return {};
}

std::string beam_modes_fault(const RobotSetup& robot, const BodyDescription& link) {
  const BeamDescription& beam = *link.beam;
  if (!beam.modes) return {};
  if (*beam.modes > 2 * beam.segments)
    return fmt::format("{} of each kind are more than the {} that {} segments have", *beam.modes, 2 * beam.segments,
                       beam.segments);
  try {
    for (const LinkMode& mode : modes_of_link(robot, link, pieces_on_springs(link, without_beam(link)), *beam.modes)) {
      if (mode.vibration.frequency <= beam.fastest_mode) continue;
      return fmt::format(
          "mode {} of {} has {:.4g} Hz with the bodies on the link, above the {:.6g} Hz of fastest_mode: keep "
          "{}, "
          "or state a larger fastest_mode, which shortens the steps of integration",
          mode.number, mode.kind->words, mode.vibration.frequency, beam.fastest_mode,
          mode.number == 1 ? "the link rigid in this direction" : fmt::format("{} of each kind", mode.number - 1));
    }
  } catch (const ModelError&) {
    return {};  // errors of the bodies are reported elsewhere
  }
  return {};
}

RobotSetup flexible_robot(const RobotSetup& robot) {
  const bool to_expand = std::any_of(robot.bodies.begin(), robot.bodies.end(), [](const BodyDescription& b) {
    return b.beam.has_value() || !b.modes.empty() || b.joint.elasticity.has_value();
  });
  return to_expand ? Expansion(robot).result() : robot;
}

RobotSetup rigid_robot(const RobotSetup& robot) {
  RobotSetup rigid = robot.undeformed ? *robot.undeformed : robot;
  for (BodyDescription& body : rigid.bodies) {
    body.beam.reset(), body.modes.clear();
    body.joint.elasticity.reset();
    if (!body.joint.spring) continue;
    // The rest position of the spring.
    const double rest = body.joint.spring->rest;
    const Vector3d& a = body.joint.axis;
    if (slides_along_axis(body.joint.type)) body.X_PF.p = body.X_PF.p + body.X_PF.R * (rest * a);
    if (turns_about_axis(body.joint.type)) body.X_PF.R = body.X_PF.R * rotation_about(a, rest);
    body.joint.type = JointType::fixed;
    body.joint.spring.reset();
  }
  return rigid;
}

bool is_elastic_part(const BodyDescription& body) {
  return yields(body.joint) && (!body.part_of.empty() || body.joint.name.starts_with(kGear));
}

bool is_unseen(const BodyDescription& body) {
  const Symmetric3d& I = body.inertia;
  return !body.part_of.empty() && (body.mass <= 0 || (I.xx == 0 && I.yy == 0 && I.zz == 0));
}

const RobotSetup& modelled_robot(const RobotSetup& robot, bool moving, std::optional<RobotSetup>& made) {
  if (!is_flexible(robot)) return robot;
  return made.emplace(moving ? flexible_robot(robot) : rigid_robot(robot));
}

CaptureProblem rigid_problem(CaptureProblem problem) {
  problem.robot = rigid_robot(RobotSetup(problem.robot));
  return problem;
}

CaptureProblem flexible_problem(CaptureProblem problem) {
  if (!is_flexible(problem.robot)) return problem;
  const Expansion expansion(problem.robot);
  for (LoadSetup& load : problem.loads) {
    if (load.body.target) continue;
    const PlaceOnPiece place = expansion.placed(load.body.name, load.p_BP);
    load.body = place.body, load.p_BP = place.p;
  }
  problem.robot = flexible_robot(RobotSetup(problem.robot));
  return problem;
}

PlaceOnPiece place_on_piece(const BodyDescription& link, const Vector3d& p) {
  if (!link.beam) return {link.name, p};
  const Beam beam(link);
  const int piece = beam.piece_of(p);
  return {piece_name(link.name, piece), p - beam.origin(piece)};
}

const std::string& link_of_piece(const BodyDescription& body) {
  return body.part_of.empty() ? body.name : body.part_of;
}

std::vector<int> pieces_of(const Model& model, const std::string& link) {
  std::vector<int> pieces{model.body_index(link)};
  for (int i = 0; i < static_cast<int>(model.bodies().size()); ++i) {
    const BodyDescription& body = model.bodies()[i].description;
    if (body.part_of == link && body.name != link && !is_unseen(body)) pieces.push_back(i);
  }
  return pieces;
}

// --- Targets ---

std::string panel_body_name(const std::string& target, const std::string& panel) { return target + "/" + panel; }

namespace {

// The target as the base of a robot, its panels as links.
RobotSetup as_robot(const TargetSetup& target) {
  RobotSetup robot;
  BodyDescription body = target_body(target);
  robot.base = body.name;
  RigidBodyInertiad rest = RigidBodyInertiad::about_com(target.mass, target.com, target.inertia);
  std::vector<BodyDescription> panels;
  for (const PanelSetup& p : target.panels) {
    BodyDescription panel;
    panel.name = panel_body_name(body.name, p.name);
    panel.parent = body.name, panel.X_PF = p.X_TP;
    panel.joint.name = panel.name;
    panel.mass = p.mass, panel.com = p.com, panel.inertia = p.inertia;
    panel.beam = p.beam, panel.modes = p.modes;
    Posed X_TP = p.X_TP;
    if (p.hinge && p.hinge_axis) {
      panel.joint.type = JointType::continuous, panel.joint.axis = *p.hinge_axis, panel.joint.spring = p.hinge;
      X_TP.R = X_TP.R * rotation_about(*p.hinge_axis, p.hinge->rest);
    }
    rest = less(rest, X_TP * RigidBodyInertiad::about_com(p.mass, p.com, p.inertia));
    for (const Geometry& shape : p.geometry) robot.geometry.emplace_back(panel.name, shape);
    panels.push_back(std::move(panel));
  }
  if (!panels.empty() && rest.mass > 0)
    body.mass = rest.mass, body.com = rest.com(), body.inertia = rest.rotational_about_com();
  if (!panels.empty() && !(rest.mass > 0)) body.mass = rest.mass;
  robot.bodies.push_back(std::move(body));
  robot.bodies.insert(robot.bodies.end(), panels.begin(), panels.end());
  return robot;
}

}  // namespace

std::string panel_fault(const TargetSetup& target) {
  if (target.panels.empty()) return {};
  const RobotSetup robot = as_robot(target);
  const BodyDescription& rest = robot.bodies.front();
  if (!(rest.mass > 0))
    return fmt::format("the panels have {:.6g} kg, more than the {:.6g} kg of the target, which include them",
                       target.mass - rest.mass, target.mass);
  if (const std::string fault = inertia_fault(rest.inertia); !fault.empty())
    return fmt::format("the target's inertia without its panels, which it includes, is not that of a rigid body: {}",
                       fault);
  for (std::size_t i = 0; i < target.panels.size(); ++i) {
    const std::string& name = target.panels[i].name;
    if (name.empty() || name == "." || name == ".." || name.find_first_of("/:") != std::string::npos)
      return fmt::format("'{}' is not a valid name of a panel: it must not be '.' or '..', nor contain '/' or ':'",
                         name);
    for (std::size_t j = 0; j < i; ++j) {
      if (target.panels[j].name == name) return fmt::format("two panels are called '{}'", name);
    }
    const BodyDescription& panel = robot.bodies[i + 1];
    std::string fault = inertia_fault(panel.inertia);
    if (fault.empty() && panel.beam) fault = beam_fault(panel);
    if (fault.empty() && panel.beam) {
      if (const std::string of_modes = beam_modes_fault(robot, panel); !of_modes.empty())
        fault = "beam.modes: " + of_modes;
    }
    if (fault.empty() && !panel.modes.empty()) fault = modes_fault(panel);
    if (!fault.empty()) return fmt::format("panel '{}': {}", target.panels[i].name, fault);
  }
  return {};
}

std::vector<CutShape> cut_shapes(const RobotSetup& robot) {
  std::vector<CutShape> all;
  for (const BodyDescription& link : robot.bodies) {
    if (!link.beam) continue;
    const Beam beam(link);
    for (const auto& [name, shape] : robot.geometry) {
      if (name != link.name) continue;
      CutShape parts = cut(shape, link.name, beam);
      if (parts.pieces.size() > 1) all.push_back(std::move(parts));
    }
  }
  return all;
}

std::vector<CutShape> cut_shapes(const TargetSetup& target) {
  return target.panels.empty() ? std::vector<CutShape>{} : cut_shapes(as_robot(target));
}

TargetBodies target_bodies(const TargetSetup& target) {
  if (target.panels.empty()) return {{target_body(target)}, {}};
  if (const std::string fault = panel_fault(target); !fault.empty())
    throw std::invalid_argument(fmt::format("target '{}': {}", target.name, fault));
  RobotSetup flexible = flexible_robot(as_robot(target));
  return {std::move(flexible.bodies), std::move(flexible.geometry)};
}

}  // namespace grapnel
