#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "grapnel/import/mjcf_file.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {

// ---- <compiler> ----

double MjcfCompiler::angle(double value) const { return degrees ? value * (M_PI / 180) : value; }

void MjcfCompiler::read(const MjcfElement& element, FaultList& faults) {
  const MjcfAttributes given{{&element}};
  static constexpr std::array kAngles{"degree", "radian"};
  static constexpr std::array kInertia{"auto", "true", "false"};
  static constexpr std::array kCoordinates{"local", "global"};
  if (given.giver("angle") != nullptr) degrees = given.word("angle", kAngles, faults) == "degree";
  if (given.giver("autolimits") != nullptr) autolimits = given.flag("autolimits", true, faults);
  if (given.giver("balanceinertia") != nullptr) balance_inertia = given.flag("balanceinertia", false, faults);
  if (given.giver("exactmeshinertia") != nullptr) exact_meshes = given.flag("exactmeshinertia", false, faults);
  if (given.giver("strippath") != nullptr) strip_paths = given.flag("strippath", false, faults);
  if (given.giver("inertiafromgeom") != nullptr) {
    const std::string word = given.word("inertiafromgeom", kInertia, faults);
    inertia = word == "true"    ? Inertia::from_geoms
              : word == "false" ? Inertia::from_element
                                : Inertia::from_geoms_where_missing;
  }
  if (given.word("coordinate", kCoordinates, faults) == "global") {
    faults.add(element.mark("coordinate"),
               "global coordinates are not supported (MuJoCo has none since 2.3.4): save the model by an older MuJoCo, "
               "which writes local ones");
  }
  if (given.giver("eulerseq") != nullptr) {
    const std::string sequence = given.text("eulerseq");
    if (sequence.size() == 3 && sequence.find_first_not_of("xyzXYZ") == std::string::npos) {
      eulerseq = sequence;
    } else {
      faults.add(element.mark("eulerseq"), fmt::format("eulerseq is {}, expected three of x, y, z (about turned axes) "
                                                       "or X, Y, Z (about fixed ones)",
                                                       in_quotes(sequence)));
    }
  }
  const auto not_negative = [&](const char* attribute, double& value) {
    const auto number = given.number(attribute, faults);
    if (!number) return;
    if (*number < 0)
      faults.add(element.mark(attribute), fmt::format("{} is {}, expected 0 or more", attribute, *number));
    value = std::max(*number, 0.0);
  };
  not_negative("boundmass", least_mass);
  not_negative("boundinertia", least_inertia);
  // Values that are not positive mean that nothing is scaled.
  if (const auto total = given.number("settotalmass", faults))
    total_mass = *total > 0 ? std::optional<double>(*total) : std::nullopt;
  if (const auto range = given.numbers("inertiagrouprange", 2, faults)) {
    first_group = static_cast<int>(std::clamp((*range)[0], -1e9, 1e9));
    last_group = static_cast<int>(std::clamp((*range)[1], -1e9, 1e9));
  }
  // assetdir stands for meshdir and texturedir, which replace it.
  if (given.giver("meshdir") != nullptr) {
    meshdir = given.text("meshdir");
  } else if (given.giver("assetdir") != nullptr) {
    meshdir = given.text("assetdir");
  }
  for (const MjcfElement& child : element.children) {
    if (child.tag() != "lengthrange")
      faults.add(child.mark(), fmt::format("<{}> is not allowed in <compiler>", child.tag()));
  }
}

// ---- Orientations ----

Rotationd mjcf_rotation_of_z(const Vector3d& v) {
  const double length = norm(v);
  if (!(length > 0)) return Rotationd::identity();
  const Vector3d to = (1 / length) * v;
  const Vector3d axis = cross(Vector3d::unit(2), to);
  const double sine = norm(axis);
  return rotation_about(sine < 1e-10 ? Vector3d::unit(0) : (1 / sine) * axis, std::atan2(sine, to[2]));
}

std::optional<Rotationd> mjcf_rotation_of(const std::vector<double>& q) {
  double largest = 0;
  for (const double c : q) largest = std::max(largest, std::abs(c));
  if (!(largest > 0)) return std::nullopt;
  double squares = 0;
  for (const double c : q) squares += (c / largest) * (c / largest);
  const double scale = std::sqrt(squares);
  const auto unit = [&](int i) { return q[i] / largest / scale; };
  return rotation_matrix(Quaterniond{unit(0), unit(1), unit(2), unit(3)});
}

namespace {

// Empty for a vector without a direction.
std::optional<Vector3d> direction_of(Vector3d v) {
  const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  if (!(largest > 1e-14)) return std::nullopt;
  v *= 1 / largest;
  return (1 / norm(v)) * v;
}

std::optional<Rotationd> axes_rotation(const std::vector<double>& xy) {
  const auto x = direction_of({xy[0], xy[1], xy[2]});
  if (!x) return std::nullopt;
  const Vector3d given{xy[3], xy[4], xy[5]};
  const auto y = direction_of(given - dot(given, *x) * *x);
  if (!y) return std::nullopt;
  const Vector3d z = cross(*x, *y);
  return Rotationd{{{(*x)[0], (*y)[0], z[0]}, {(*x)[1], (*y)[1], z[1]}, {(*x)[2], (*y)[2], z[2]}}};
}

Rotationd euler_rotation(const std::vector<double>& euler, const MjcfCompiler& compiler) {
  Rotationd R = Rotationd::identity();
  for (int i = 0; i < 3; ++i) {
    const char letter = compiler.eulerseq[i];
    const bool fixed = std::isupper(static_cast<unsigned char>(letter)) != 0;
    const Rotationd turn = rotation_about(Vector3d::unit(std::tolower(letter) - 'x'), compiler.angle(euler[i]));
    R = fixed ? turn * R : R * turn;
  }
  return R;
}

struct RotationForm {
  const char* attribute;
  std::size_t count;
};
constexpr std::array<RotationForm, 5> kRotationForms{
    {{"quat", 4}, {"axisangle", 4}, {"xyaxes", 6}, {"zaxis", 3}, {"euler", 3}}};

// The form that counts; null if there is none or they contradict each other, which is a fault. Of a quaternion in one
// layer and another form in another one the other form counts, whichever is the element's own: so does MuJoCo.
const RotationForm* rotation_form(const MjcfAttributes& attributes, FaultList& faults) {
  const RotationForm* form = nullptr;
  for (const RotationForm& next : kRotationForms) {
    const MjcfElement* giver = attributes.giver(next.attribute);
    if (giver == nullptr) continue;
    const bool replaces_quaternion = form == kRotationForms.data() && attributes.giver(form->attribute) != giver;
    if (form != nullptr && !replaces_quaternion) {
      faults.add(giver->mark(next.attribute),
                 fmt::format("<{}> has two orientations, {} and {}; give one (default classes count)",
                             attributes.element().tag(), form->attribute, next.attribute));
      return nullptr;
    }
    form = &next;
  }
  return form;
}

}  // namespace

Rotationd mjcf_rotation(const MjcfAttributes& attributes, const MjcfCompiler& compiler, FaultList& faults) {
  const RotationForm* form = rotation_form(attributes, faults);
  if (form == nullptr) return Rotationd::identity();
  const std::string_view name = form->attribute;
  const auto numbers = attributes.numbers(form->attribute, form->count, faults);
  if (!numbers) return Rotationd::identity();
  std::optional<Rotationd> R;
  if (name == "quat") R = mjcf_rotation_of(*numbers);
  if (name == "xyaxes") R = axes_rotation(*numbers);
  if (name == "euler") R = euler_rotation(*numbers, compiler);
  if (name == "zaxis") {
    if (const auto z = direction_of({(*numbers)[0], (*numbers)[1], (*numbers)[2]})) R = mjcf_rotation_of_z(*z);
  }
  if (name == "axisangle") {
    if (const auto axis = direction_of({(*numbers)[0], (*numbers)[1], (*numbers)[2]}))
      R = rotation_about(*axis, compiler.angle((*numbers)[3]));
  }
  if (R) return *R;
  faults.add(
      attributes.mark(form->attribute),
      fmt::format("{} of <{}> gives no direction: vectors are zero or parallel", name, attributes.element().tag()));
  return Rotationd::identity();
}

Posed mjcf_pose(const MjcfAttributes& attributes, const MjcfCompiler& compiler, FaultList& faults) {
  const Rotationd R = mjcf_rotation(attributes, compiler, faults);
  return {R, attributes.vector("pos", faults).value_or(Vector3d::zero())};
}

// ---- What is passed over ----

namespace {

struct Vocabulary {
  const char* tag;
  const char* read;  // attributes that are read, or refused where they matter
  const char* idle;  // without influence on the motion
};

// The names are those of MuJoCo's documentation up to version 3.3.
constexpr std::array<Vocabulary, 16> kVocabulary{{
    {"mujoco", "model", ""},
    {"compiler",
     "angle autolimits balanceinertia strippath inertiafromgeom coordinate eulerseq boundmass boundinertia "
     "settotalmass inertiagrouprange meshdir assetdir exactmeshinertia",
     "usethread convexhull fitaabb texturedir discardvisual fusestatic alignfree saveinertial "
     "conflict"},
    {"default", "class", ""},
    {"body", "name childclass pos quat axisangle xyaxes zaxis euler mocap", "gravcomp user sleep"},
    {"frame", "name childclass pos quat axisangle xyaxes zaxis euler", ""},
    {"inertial", "pos quat axisangle xyaxes zaxis euler mass diaginertia fullinertia", ""},
    {"freejoint", "name", "group align"},
    {"joint",
     "name class type pos axis limited range ref stiffness springdamper armature damping frictionloss actuatorfrcrange "
     "actuatorfrclimited",
     "group springref solreflimit solimplimit solreffriction solimpfriction margin user actuatorgravcomp"},
    {"geom",
     "name class type size fromto pos quat axisangle xyaxes zaxis euler mass density shellinertia group contype "
     "conaffinity mesh",
     "condim priority material rgba friction solmix solref solimp margin gap hfield fitscale fluidshape fluidcoef "
     "user"},
    {"site", "name class pos quat axisangle xyaxes zaxis euler fromto", "type size group material rgba user"},
    {"mesh", "name class file scale refpos refquat inertia",
     "smoothnormal maxhullvert content_type vertex normal texcoord face builtin params material "
     "octree_maxdepth"},
    {"option", "density viscosity", "*"},
    {"actuator",
     "name class joint jointinparent tendon slidersite cranksite site body gear ctrllimited ctrlrange forcelimited "
     "forcerange gaintype gainprm biastype",
     "group actlimited actrange lengthrange cranklength refsite user dyntype dynprm biasprm actdim actearly kp kv "
     "dampratio timeconst inheritrange area diameter bias gain delay nsample interp"},
    {"equality", "name class active joint1 joint2 polycoef", "solref solimp"},
    {"tendon", "name class stiffness damping frictionloss armature limited range",
     "group actuatorfrclimited actuatorfrcrange solreflimit solimplimit solreffriction solimpfriction margin "
     "springlength "
     "width material rgba user"},
    {"plugin", "", "*"},
}};

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    words.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return words;
}

bool has_word(std::string_view text, std::string_view word) {
  for (std::size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || text[at - 1] == ' ') && (end == text.size() || text[end] == ' ')) return true;
  }
  return false;
}

}  // namespace

void MjcfPassedOver::check_attributes(const MjcfElement& element, FaultList& faults, const char* kind) {
  const std::string words = kind != nullptr ? kind : mjcf_kind(element.tag());
  const auto* const known = std::ranges::find_if(kVocabulary, [&](const Vocabulary& v) { return words == v.tag; });
  if (known == kVocabulary.end()) return;
  for (const pugi::xml_attribute& attribute : element.node.attributes()) {
    const std::string_view name = attribute.name();
    if (has_word(known->read, name)) continue;
    if (std::string_view(known->idle) == "*" || has_word(known->idle, name)) {
      Count& count = attributes_[element.tag()][std::string(name)];
      if (count.count++ == 0) count.first = element.mark(attribute.name());
      continue;
    }
    std::vector<std::string> candidates = words_of(known->read);
    for (std::string& idle : words_of(known->idle)) candidates.push_back(std::move(idle));
    faults.add(element.mark(attribute.name()), fmt::format("<{}> has no attribute {} in MJCF{}", element.tag(),
                                                           in_quotes(name), suggestion(name, candidates)));
  }
}

void MjcfPassedOver::element(const MjcfElement& element, const std::string& reason) {
  Count& count = elements_[{element.tag(), reason}];
  if (count.count++ == 0) count.first = element.mark();
}

void MjcfPassedOver::say(std::vector<ImportDecision>& decisions) const {
  for (const auto& [key, count] : elements_) {
    const auto& [tag, reason] = key;
    decisions.push_back(
        {count.first, fmt::format("<{}> ({}): {}", shortened(printable_line(tag)), count.count, reason)});
  }
  for (const auto& [tag, names] : attributes_) {
    std::string list;
    for (const auto& [name, count] : names)
      list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", shortened(printable_line(name)), count.count);
    decisions.push_back(
        {names.begin()->second.first, fmt::format("<{}>: without influence on the motion, not read: {}", tag, list)});
  }
}

}  // namespace grapnel
