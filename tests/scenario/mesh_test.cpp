// Meshes from STL, OBJ and Collada files: resulting shapes, input errors, and random bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/scenario/mesh_files.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace mesh_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

// A tetrahedron with its right angles at the origin.
const char* const kTextStl = R"(solid corner of a box
  facet normal 0 0 -1
    outer loop
      vertex 0 0 0
      vertex 0 2 0
      vertex 1e0 0 0
    endloop
  endfacet
facet normal 0 0 0
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 0 +3.0
endloop
endfacet
facet normal 0 0 0
outer loop
vertex -0 0 0
vertex 0 0 3
vertex 0 2 0
endloop
endfacet
facet normal 0 0 0
outer loop
vertex 1 0 0
vertex 0 2 0
vertex 0 0 3
endloop
endfacet
endsolid corner of a box
)";

const char* const kObj = R"(# a box corner
mtllib none.mtl
o corner
v 0 0 0
v 1 0 0 1.0
vn 0 0 1
vt 0.5 0.5
v 0 2 0 0.1 0.2 0.3   # coloured
f 1/1/1 3//1 2/1      # of these only the first number counts
usemtl paint
s off
v 0 0 3
f -4 -3 -1
f 1 4 3
f 2 3 4
l 1 2
)";

using Facets = std::vector<std::array<Vector3d, 3>>;
const Facets kCorner{{{{0, 0, 0}, {0, 2, 0}, {1, 0, 0}}},
                     {{{0, 0, 0}, {1, 0, 0}, {0, 0, 3}}},
                     {{{0, 0, 0}, {0, 0, 3}, {0, 2, 0}}},
                     {{{1, 0, 0}, {0, 2, 0}, {0, 0, 3}}}};

void append(std::string& bytes, std::uint32_t value) {
  for (int k = 0; k < 4; ++k) bytes.push_back(static_cast<char>(value >> (8 * k) & 0xff));
}
std::string binary_stl(const Facets& facets, std::string header = "made by hand") {
  header.resize(80);
  std::string bytes = header;
  append(bytes, static_cast<std::uint32_t>(facets.size()));
  for (const auto& facet : facets) {
    for (int k = 0; k < 3; ++k) append(bytes, 0x7fc00000);  // NaN normal, which is not read
    for (const Vector3d& p : facet) {
      for (double x : p.e) append(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(x)));
    }
    bytes += "xy";
  }
  return bytes;
}

// Triangles with corner coordinates instead of vertex indices.
Facets facets_of(const TriangleMesh& mesh) {
  Facets facets;
  for (const auto& t : mesh.triangles)
    facets.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
  return facets;
}
void expect_corner(const std::shared_ptr<const TriangleMesh>& mesh) {
  ASSERT_TRUE(mesh);
  EXPECT_THAT(mesh->vertices, SizeIs(4));
  const Facets facets = facets_of(*mesh);
  ASSERT_THAT(facets, SizeIs(4));
  for (std::size_t f = 0; f < 4; ++f) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(norm(facets[f][k] - kCorner[f][k]), 0) << f << k;
  }
  EXPECT_THAT(mesh->hull.normals, SizeIs(4));
}

std::shared_ptr<const TriangleMesh> mesh_in(std::string_view bytes, const char* name) {
  FaultList faults;
  auto mesh = read_mesh(bytes, std::filesystem::path("folder") / name, faults);
  EXPECT_TRUE(faults.empty()) << faults.all()[0].text();
  return mesh;
}
std::string fault_in(std::string_view bytes, const char* name) {
  FaultList faults;
  EXPECT_FALSE(read_mesh(bytes, name, faults));
  return faults.size() == 1 ? faults.all()[0].text() : "not one fault";
}
std::string replaced(std::string text, const std::string& what, const std::string& with) {
  return text.replace(text.find(what), what.size(), with);
}

TEST(ReadMesh, AllFormatsProduceTheSameMesh) {
  expect_corner(mesh_in(kTextStl, "a.stl"));
  expect_corner(mesh_in(kObj, "a.OBJ"));
  expect_corner(mesh_in(binary_stl(kCorner), "a.Stl"));
  expect_corner(mesh_in(binary_stl(kCorner, "solid says a binary file too"), "a.stl"));
  EXPECT_EQ(mesh_in(kObj, "part.obj")->name, "part.obj");
  std::string windows;
  for (const char* c = kTextStl; *c; ++c) windows += *c == '\n' ? "\r\n" : std::string(1, *c);
  expect_corner(mesh_in(windows, "a.stl"));
  std::string shouted = kTextStl;
  for (char& c : shouted) c = static_cast<char>(std::toupper(c));
  expect_corner(mesh_in(shouted, "a.stl"));
  expect_corner(mesh_in(std::string(kTextStl) + "solid empty\nendsolid\n", "a.stl"));
}

TEST(ReadMesh, FansPolygonsAndDropsDegenerateTriangles) {
  const auto mesh =
      mesh_in("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 9 9 9\nv 0 0 -0\nf 4 3 2 1\nf 1 2 5\nf 1 1 2\nf 1 2 7\n",
              "a.obj");
  EXPECT_THAT(mesh->triangles, SizeIs(3));  // the last two are degenerate
  EXPECT_THAT(mesh->vertices, SizeIs(5));   // the sixth is unused, and the last equals the first
  EXPECT_EQ(mesh->hull.half[2], 0.5);
}

TEST(ReadMesh, ReportsErrorsOfAnStlText) {
  const auto fault = [](const std::string& what, const std::string& with) {
    return fault_in(replaced(kTextStl, what, with), "a.stl");
  };
  EXPECT_EQ(fault("vertex 0 2 0", "vertex 0 2"), "a.stl:5:7: error: a vertex must have 3 coordinates");
  EXPECT_EQ(fault("vertex 0 2 0", "vertex 0 two 0"), "a.stl:5:16: error: a coordinate must be a number, not 'two'");
  EXPECT_EQ(fault("vertex 0 2 0", "vertex 0 nan 0"),
            "a.stl:5:16: error: a coordinate is 'nan', must be a finite number below 1e+09");
  EXPECT_EQ(fault("vertex 0 2 0", "vertex 0 -1e400 0"),
            "a.stl:5:16: error: a coordinate is '-1e400', must be a finite number below 1e+09");
  EXPECT_EQ(fault("vertex 0 2 0", "vertex 0 1e9 0"),
            "a.stl:5:16: error: a coordinate is '1e9', must be a finite number below 1e+09");
  EXPECT_EQ(fault("    endloop\n", ""), "a.stl:7:3: error: expected 'endloop', not 'endfacet'");
  EXPECT_EQ(fault("vertex 0 2 0\n", "endloop\n"), "a.stl:5:7: error: expected 'vertex', not 'endloop'");
  EXPECT_EQ(fault("endsolid corner of a box\n", ""),
            "a.stl:29:1: error: the file ends without 'endsolid': it is truncated");
  EXPECT_EQ(fault_in("solid a\nendsolid a\n", "a.stl"), "a.stl: error: the mesh has no triangle");
  EXPECT_EQ(fault_in("solid a\nendsolid a\nfacet", "a.stl"), "a.stl:3:1: error: expected 'solid', not 'facet'");
}

TEST(ReadMesh, ReportsErrorsOfABinaryStl) {
  const std::string whole = binary_stl(kCorner);
  EXPECT_EQ(
      fault_in(whole.substr(0, whole.size() - 1), "a.stl"),
      "a.stl: error: a binary STL file of 4 triangles has 284 bytes, this one 283: it is truncated or not an STL file");
  EXPECT_EQ(fault_in("PK", "a.stl"),
            "a.stl: error: not an STL file: 2 bytes are too few for a binary one, and it is not a text that begins "
            "with 'solid'");
  EXPECT_EQ(fault_in("", "a.stl"), fault_in("", "a.stl"));
  Facets facets = kCorner;
  facets[2][1][2] = std::nan("");
  EXPECT_EQ(fault_in(binary_stl(facets), "a.stl"),
            "a.stl: error: triangle 3: a coordinate is nan, must be a finite number below 1e+09");
  EXPECT_EQ(fault_in(binary_stl({}), "a.stl"), "a.stl: error: the mesh has no triangle");
  EXPECT_EQ(fault_in(binary_stl({kCorner[0]}), "a.stl"),
            "a.stl: error: the mesh is flat: all its vertices lie in one plane; give it a thickness");
  EXPECT_EQ(fault_in(binary_stl({{{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}}}), "a.stl"),
            "a.stl: error: the mesh has no triangle with positive area");
  EXPECT_EQ(fault_in(binary_stl(Facets(200'001, kCorner[0])), "a.stl"),
            "a.stl: error: the mesh has 200001 triangles, at most 200000 are read; simplify it");
}

TEST(ReadMesh, TakesFilesAsProgramsWriteThem) {
  // Bytes after the counted triangles give a warning.
  const auto warned = [](const std::string& bytes) {
    FaultList faults;
    expect_corner(read_mesh(bytes, "a.stl", faults));
    EXPECT_TRUE(faults.empty());
    return faults.warnings().size() == 1 ? faults.warnings()[0].text() : "not one warning";
  };
  EXPECT_EQ(warned(binary_stl(kCorner) + "\n"),
            "a.stl: warning: 1 byte behind the 4 triangles that the binary STL file counts: not read");
  EXPECT_THAT(warned(binary_stl(kCorner) + std::string(100, 'x')), HasSubstr("100 bytes behind the 4 triangles"));
  EXPECT_THAT(warned(binary_stl(kCorner, "solid says a binary file too") + "\r\n"), HasSubstr("2 bytes behind"));
  // A byte order mark, and carriage returns alone.
  expect_corner(mesh_in("\xef\xbb\xbf" + std::string(kTextStl), "a.stl"));
  std::string returns = kTextStl;
  std::replace(returns.begin(), returns.end(), '\n', '\r');
  expect_corner(mesh_in(returns, "a.stl"));
  expect_corner(mesh_in("\xef\xbb\xbf" + returns, "a.stl"));
  EXPECT_EQ(fault_in(replaced(returns, "vertex 0 2 0", "vertex 0 two 0"), "a.stl"),
            "a.stl:5:16: error: a coordinate must be a number, not 'two'");
  returns = kObj;
  std::replace(returns.begin(), returns.end(), '\n', '\r');
  expect_corner(mesh_in(returns, "a.obj"));
  // OBJ lines that continue after a backslash.
  expect_corner(mesh_in(
      replaced(replaced(kObj, "f 1/1/1 3//1 2/1 ", "f 1/1/1 \\\n 3//1\\\r\n2/1 "), "v 1 0 0", "v 1 \\\n0 0"), "a.obj"));
  EXPECT_EQ(fault_in("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 \\\n  2 x\n", "a.obj").substr(0, 13), "a.obj:5:5: er");
}

// The corner of kTextStl in centimetres with y upwards; one node shifts it, and another shifts it back.
std::string collada(const std::string& body, const std::string& asset = "<unit meter='0.01'/><up_axis>Y_UP</up_axis>") {
  return "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset>" +
         asset + "</asset>\n" + body + "</COLLADA>";
}
const std::string kColladaSource =
    "<source id='s'><float_array id='f' count='12'>0 0 0  100 0 0\n 0 0 -200  0 300 0</float_array><technique_common>"
    "<accessor source='#f' count='4' stride='3'/></technique_common></source>"
    "<vertices id='v'><input semantic='POSITION' source='#s'/></vertices>\n";
const std::string kColladaTriangles =
    "<triangles count='4'><input semantic='VERTEX' source='#v' offset='0'/><input semantic='NORMAL' source='#n' "
    "offset='1'/>"
    "<p>0 9 2 9 1 9  0 9 1 9 3 9  0 9 3 9 2 9  1 9 2 9 3 9</p></triangles>";
std::string collada_geometry(const std::string& part) {
  return "<library_geometries><geometry id='g'><mesh>" + kColladaSource + part +
         "</mesh></geometry></library_geometries>";
}
const std::string kColladaScene =
    "<library_visual_scenes><visual_scene id='vs'><node><translate>500 0 0</translate><rotate>0 0 1 90</rotate>"
    "<node><rotate>0 0 1 -90</rotate><translate>-500 0 0</translate><instance_geometry url='#g'/></node></node>"
    "</visual_scene></library_visual_scenes><scene><instance_visual_scene url='#vs'/></scene>";

void expect_near_corner(const std::shared_ptr<const TriangleMesh>& mesh) {
  ASSERT_TRUE(mesh);
  const Facets facets = facets_of(*mesh);
  ASSERT_THAT(facets, SizeIs(4));
  for (std::size_t f = 0; f < 4; ++f) {
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_LT(norm(facets[f][k] - kCorner[f][k]), 1e-14) << f << k;  // measured 9e-16
  }
}

TEST(ReadMesh, TakesColladaInMetresWithZUpwards) {
  expect_near_corner(mesh_in(collada(collada_geometry(kColladaTriangles)), "a.dae"));
  expect_near_corner(mesh_in(collada(collada_geometry(kColladaTriangles) + kColladaScene), "a.DAE"));
  // The same triangles in other primitives.
  const std::string inputs = "<input semantic='VERTEX' source='#v' offset='0'/>";
  for (const std::string& part :
       {"<polylist count='4'>" + inputs + "<vcount>3 3 3 3</vcount><p>0 2 1 0 1 3 0 3 2 1 2 3</p></polylist>",
        "<polygons count='4'>" + inputs +
            "<p>0 2 1</p><p>0 1 3</p><ph><p>0 3 2</p><h>0 1 2</h></ph><p>1 2 3</p></polygons>",
        "<tristrips count='4'>" + inputs + "<p>0 2 1</p><p>0 1 3</p><p>0 3 2</p><p>1 2 3</p></tristrips>",
        "<trifans count='4'>" + inputs + "<p>0 2 1</p><p>0 1 3</p><p>0 3 2</p><p>1 2 3</p></trifans>"})
    expect_near_corner(mesh_in(collada(collada_geometry(part)), "a.dae"));
  // Other axes and units; matrices, scales, nodes of a library, a skin.
  const auto extent = [](const std::string& text) {
    const auto mesh = mesh_in(text, "a.dae");
    Vector3d low{9, 9, 9}, high{-9, -9, -9};
    for (const Vector3d& p : mesh->vertices) {
      for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
    }
    return std::pair{low, high};
  };
  const auto z_up = extent(collada(collada_geometry(kColladaTriangles), "<unit meter='0.01'/><up_axis>Z_UP</up_axis>"));
  EXPECT_EQ(norm(z_up.first - Vector3d{0, 0, -2}) + norm(z_up.second - Vector3d{1, 3, 0}), 0);
  const auto x_up = extent(collada(collada_geometry(kColladaTriangles), "<unit meter='0.01'/><up_axis>X_UP</up_axis>"));
  EXPECT_EQ(norm(x_up.first - Vector3d{-3, 0, 0}) + norm(x_up.second - Vector3d{0, 2, 1}), 0);
  const auto plain = extent(collada(
      collada_geometry(kColladaTriangles) +
          "<library_controllers><controller id='c'><skin source='#g'><bind_shape_matrix>0.01 0 0 0 0 0.01 0 0 0 0 0.01 "
          "0 0 "
          "0 0 1</bind_shape_matrix></skin></controller></library_controllers>"
          "<library_nodes><node id='n'><scale>1 2 1</scale><instance_controller url='#c'/></node></library_nodes>"
          "<library_visual_scenes><visual_scene id='vs'><node><matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix>"
          "<instance_node url='#n'/></node></visual_scene></library_visual_scenes>"
          "<scene><instance_visual_scene url='#vs'/></scene>",
      "<up_axis>Z_UP</up_axis>"));
  EXPECT_LT(norm(plain.first - Vector3d{5, 0, -2}) + norm(plain.second - Vector3d{6, 6, 0}), 1e-14);
}

TEST(ReadMesh, ReportsErrorsOfACollada) {
  const auto fault = [](const std::string& what, const std::string& with) {
    return fault_in(replaced(collada(collada_geometry(kColladaTriangles) + kColladaScene), what, with), "a.dae");
  };
  EXPECT_EQ(fault_in("<a/>", "a.dae"), "a.dae:1:2: error: the outermost element is <a>, expected <COLLADA>");
  EXPECT_THAT(fault_in("nothing", "a.dae"), HasSubstr("error: this is no well-formed XML"));
  EXPECT_THAT(fault("'#g'/", "'#h'/"), HasSubstr("expected the id of a <geometry> in this file"));
  EXPECT_THAT(fault("meter='0.01'", "meter='0'"), HasSubstr("the meter of <unit> must be a number greater than 0"));
  EXPECT_THAT(fault("Y_UP", "up"), HasSubstr("'up' is not an axis"));
  EXPECT_THAT(fault("0 300 0", "0 nan 0"), HasSubstr("<float_array>: 'nan' is not a finite number"));
  EXPECT_THAT(fault("0 300 0", "0 1e300 0"), HasSubstr("must be a finite number below 1e+09"));
  EXPECT_THAT(fault("count='4' stride", "count='5' stride"),
              HasSubstr("asks for 5 places, and the <float_array> has 12"));
  EXPECT_THAT(fault("3 9</p>", "4 9</p>"), HasSubstr("there is no vertex 4: the source has 4"));
  EXPECT_THAT(fault("3 9</p>", "3</p>"), HasSubstr("expected a multiple of 2"));
  EXPECT_THAT(fault("VERTEX", "COLOR"), HasSubstr("<triangles> has no input VERTEX"));
  EXPECT_THAT(fault("<translate>500", "<skew>500"), HasSubstr("no well-formed XML"));
  EXPECT_THAT(fault("500 0 0</translate>", "500 0</translate>"), HasSubstr("<translate> has 2 numbers, expected 3"));
  EXPECT_THAT(fault(kColladaTriangles, ""), HasSubstr("the mesh has no triangle"));
  // Nodes that contain themselves, or each other many times.
  std::string nodes;
  for (int i = 0; i < 40; ++i)
    nodes +=
        fmt::format("<node id='n{0}'><instance_node url='#n{1}'/><instance_node url='#n{1}'/></node>", i, (i + 1) % 40);
  EXPECT_THAT(fault_in(collada("<library_nodes>" + nodes +
                               "</library_nodes><library_visual_scenes><visual_scene id='vs'>"
                               "<node><instance_node url='#n0'/></node></visual_scene></library_visual_scenes>"
                               "<scene><instance_visual_scene url='#vs'/></scene>"),
                       "a.dae"),
              HasSubstr("nodes"));
}

TEST(ReadMesh, ReportsErrorsOfAnObj) {
  const std::string places = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const auto fault = [&](const std::string& line) { return fault_in(places + line, "a.obj"); };
  EXPECT_EQ(fault("v 1 2\n"), "a.obj:4:1: error: a vertex must have 3 coordinates");
  EXPECT_EQ(fault("v 1 2 x\n"), "a.obj:4:7: error: a coordinate must be a number, not 'x'");
  EXPECT_EQ(fault("f 1 2\n"), "a.obj:4:1: error: a face must have at least 3 vertices");
  EXPECT_EQ(fault("f 1 2 4\n"), "a.obj:4:7: error: there is no vertex 4: the file has 3");
  EXPECT_EQ(fault("f 1 2 -4\n"), "a.obj:4:7: error: there is no vertex -4: 3 are before this line");
  EXPECT_THAT(fault("f 1 2 0\n"), HasSubstr("a.obj:4:7: error: a face must name vertices by whole numbers from 1, or"));
  EXPECT_THAT(fault("f 1 2 1.5\n"), HasSubstr("not '1.5'"));
  EXPECT_THAT(fault("f 1 /2 3\n"), HasSubstr("a.obj:4:5: error: a face must name"));
  EXPECT_THAT(fault("f 1 2 99999999999999999999\n"), HasSubstr("not '99999999999999999999'"));
  EXPECT_EQ(fault("f 1 2 3\n"),
            "a.obj: error: the mesh is flat: all its vertices lie in one plane; give it a thickness");
  EXPECT_EQ(fault(""), "a.obj: error: the mesh has no triangle");
  std::string many = places;
  for (int i = 0; i < 200'001; ++i) many += "f 1 2 3\n";
  EXPECT_EQ(fault_in(many, "a.obj"), "a.obj:200004:1: error: the mesh has more than 200000 triangles; simplify it");
}

// Any bytes give a mesh or one error.
TEST(ReadMesh, SurvivesAnyBytes) {
  std::mt19937 random(1);
  const auto number = [&](int below) { return static_cast<int>(random() % static_cast<unsigned>(below)); };
  const std::string wholes[] = {kTextStl, binary_stl(kCorner), kObj,
                                collada(collada_geometry(kColladaTriangles) + kColladaScene)};
  const char* const words[] = {"v ",      "f ",       "\n",       " 1",           " -1",    " 2/3",    "1e308",
                               " nan",    "solid ",   "facet ",   "outer loop\n", "vertex", "#",       "\0",
                               "endloop", "endfacet", "endsolid", " 0",           " 1 2 3", "\xff\xfe"};
  int read = 0;
  for (int i = 0; i < 30000; ++i) {
    std::string bytes = wholes[number(4)];
    const int kind = number(4);
    if (kind == 0) {
      bytes.resize(static_cast<std::size_t>(number(400)));
      for (char& c : bytes) c = static_cast<char>(number(256));
    } else if (kind == 1) {
      bytes = number(2) ? "solid x\n" : "";
      for (int n = number(60); n > 0; --n) bytes += words[number(std::size(words))];
    } else {
      for (int n = 1 + number(4); n > 0; --n) {
        const std::size_t at = static_cast<std::size_t>(number(static_cast<int>(bytes.size())));
        if (number(3) == 0)
          bytes.insert(at, words[number(std::size(words))]);
        else if (number(2) == 0)
          bytes.erase(at, static_cast<std::size_t>(number(5)));
        else
          bytes[at] = static_cast<char>(number(256));
      }
    }
    for (const char* name : {"a.stl", "a.obj", "a.dae"}) {
      FaultList faults;
      const auto mesh = read_mesh(bytes, name, faults);
      EXPECT_EQ(faults.size(), mesh ? 0u : 1u);
      if (!mesh) continue;
      ++read;
      EXPECT_FALSE(mesh->hull.is_empty());
      for (const auto& t : mesh->triangles) {
        for (const int v : t) EXPECT_LT(static_cast<std::size_t>(v), mesh->vertices.size());
      }
    }
  }
  EXPECT_GT(read, 3000);
  std::printf("[ measured ] %d of 90000 were meshes\n", read);
}

// --- In scenarios ---

class MeshInScenario : public testing::Test {
 protected:
  MeshInScenario() {
    folder_.write("part.stl", kTextStl);
    std::filesystem::create_directory(folder_.path() / "robots");
    folder_.write("robots/arm.stl", binary_stl(kCorner));
  }
  // The small scenario with meshes on the ball and on the lower link; the robot file is in another folder.
  std::filesystem::path write(const std::string& ball, const std::string& lower) {
    const std::string whole = kSmallScenario;
    const std::size_t begin = whole.find("robot:"), end = whole.find("initial:");
    std::string robot = small_robot();
    robot = replaced(robot, "joint: {name: elbow", "geometry: " + lower + "\n    joint: {name: elbow");
    folder_.write("robots/arm.yaml", robot);
    const std::string text = whole.substr(0, begin) + "robot: robots/arm.yaml\n" + whole.substr(end);
    return folder_.write("scenario.yaml",
                         replaced(text, "  - name: ball\n", "  - name: ball\n    geometry: " + ball + "\n"));
  }
  const std::string ball_ = "{shape: mesh, file: part.stl, scale: 0.001, position: [1, 2, 3]}";
  const std::string lower_ = "{shape: mesh, file: arm.stl}";
  TemporaryFolder folder_;
};

TEST_F(MeshInScenario, PathsAreRelativeToTheReferringFile) {
  const CaptureProblem p = load_scenario(write(ball_, lower_));
  const Geometry& ball = p.targets[0].geometry.at(0);
  EXPECT_EQ(ball.shape, Geometry::Shape::mesh);
  EXPECT_THAT(ball.size.e, ElementsAre(0.001, 0.001, 0.001));
  EXPECT_THAT(ball.X_BG.p.e, ElementsAre(1, 2, 3));
  expect_corner(ball.mesh);
  EXPECT_EQ(ball.mesh->name, "part.stl");
  ASSERT_THAT(p.robot.geometry, SizeIs(1));
  EXPECT_EQ(p.robot.geometry[0].first, "lower");
  EXPECT_THAT(p.robot.geometry[0].second.size.e, ElementsAre(1, 1, 1));
  expect_corner(p.robot.geometry[0].second.mesh);
  expect_corner(load_robot(folder_.path() / "robots/arm.yaml").geometry[0].second.mesh);
}

TEST_F(MeshInScenario, OverridesCanChooseThem) {
  folder_.write("other.obj", kObj);
  folder_.write("robots/other.obj", kObj);
  const auto path = write(ball_, lower_);
  const CaptureProblem p = load_scenario(path, std::vector<Override>{{"targets[0].geometry.file", "other.obj"},
                                                                     {"robot.links[1].geometry.file", "other.obj"},
                                                                     {"targets[0].geometry.scale", "2"}});
  EXPECT_EQ(p.targets[0].geometry.at(0).mesh->name, "other.obj");
  EXPECT_EQ(p.targets[0].geometry.at(0).size[0], 2);
  EXPECT_EQ(p.robot.geometry[0].second.mesh->name, "other.obj");
}

// A scenario written to another folder; it contains the robot inline if a robot value was changed.
TEST_F(MeshInScenario, FilesAreFoundFromAnotherPlace) {
  const auto path = write(ball_, lower_);
  Change change{"robot.base.mass", {}, {}, "90"};
  change.value.kind = Node::Kind::scalar;
  change.value.text = "90";
  const std::vector<Change> changes{change};
  std::filesystem::create_directories(folder_.path() / "out" / "far");
  for (const auto& some : {changes, std::vector<Change>{}}) {
    ScenarioFiles files;
    const CaptureProblem p = load_scenario(path, some, files);
    const std::filesystem::path place = folder_.path() / "out" / "far" / "best.yaml";
    const std::string text = changed_scenario_text({path, changed_tree(path, some, files), p}, p, place, "", "moved");
    const CaptureProblem moved = load_scenario(folder_.write("out/far/best.yaml", text));
    EXPECT_EQ(moved.robot.bodies[0].mass, some.empty() ? 100 : 90);
    ASSERT_THAT(moved.robot.geometry, SizeIs(1));
    expect_corner(moved.robot.geometry[0].second.mesh);
    expect_corner(moved.targets[0].geometry.at(0).mesh);
  }
}

TEST_F(MeshInScenario, TheHashCoversTheirBytes) {
  const auto path = write(ball_, lower_);
  const std::string before = load_scenario(path).sha256;
  EXPECT_EQ(load_scenario(path).sha256, before);
  folder_.write("part.stl", std::string(kTextStl) + "\n");
  const std::string after = load_scenario(path).sha256;
  EXPECT_NE(after, before);
  folder_.write("robots/arm.stl", binary_stl(kCorner, "another header"));
  EXPECT_NE(load_scenario(path).sha256, after);
}

TEST_F(MeshInScenario, ReportsErrors) {
  const auto faults = [&](const std::string& ball) { return faults_of_file(write(ball, lower_)); };
  EXPECT_THAT(faults("{shape: mesh, file: none.stl}"), ElementsAre(HasSubstr("scenario.yaml:7:35: error: ")));
  EXPECT_THAT(faults("{shape: mesh, file: part.step}"),
              ElementsAre("scenario.yaml:7:35: error: mesh file 'part.step' must end in .stl, .obj or .dae"));
  EXPECT_THAT(faults("{shape: mesh}"), ElementsAre(HasSubstr("file")));
  EXPECT_THAT(faults("{shape: mesh, file: ''}"), ElementsAre(HasSubstr("file")));
  EXPECT_THAT(faults("{shape: mesh, file: part.stl, scale: 0}"), ElementsAre(HasSubstr("scale")));
  EXPECT_THAT(faults("{shape: mesh, file: part.stl, radius: 1}"), ElementsAre(HasSubstr("radius")));
  EXPECT_THAT(faults("{shape: sphere, radius: 1, file: part.stl}"), ElementsAre(HasSubstr("file")));
  EXPECT_THAT(faults("{shape: box, size: [1, 1, 1], scale: 2}"), ElementsAre(HasSubstr("scale")));
  folder_.write("part.stl", replaced(kTextStl, "vertex 0 2 0", "vertex 0 two 0"));
  EXPECT_THAT(faults(ball_), ElementsAre("part.stl:5:16: error: a coordinate must be a number, not 'two'"));
  // Errors of both meshes, the robot's and the target's.
  folder_.write("robots/arm.stl", "nothing");
  EXPECT_THAT(faults(ball_), ElementsAre(HasSubstr("part.stl:5:16: error: "), HasSubstr("arm.stl: error: not an STL")));
  // A folder whose name has a valid mesh extension.
  std::filesystem::create_directory(folder_.path() / "folder.stl");
  EXPECT_THAT(faults("{shape: mesh, file: folder.stl}"), SizeIs(2));
}

}  // namespace mesh_test
}  // namespace grapnel::test
