#include <stdexcept>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"
#include "grapnel/study/grid.hpp"
#include "grapnel/study/study_table.hpp"

namespace grapnel {
namespace {

using hdf5::Handle;
using hdf5::write_attribute;

void describe(const Handle& dataset, const std::string& unit, const std::string& description, int order) {
  write_attribute(dataset, "unit", unit);
  write_attribute(dataset, "description", description);
  write_attribute(dataset, "order", order);
}

void write_numbers(const Handle& file, const std::string& path, const std::vector<double>& values,
                   const StudyTable::Head& head, int order) {
  const Handle dataset =
      hdf5::write_dataset(file, path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, {values.size()}, values.data());
  describe(dataset, head.unit, head.description, order);
}

// A dataset cannot be a group too: beside "captured", "captured/judged" is "captured.judged".
std::string dataset_name(const std::vector<StudyTable::Head>& columns, std::size_t column) {
  std::string name = columns[column].name;
  for (const StudyTable::Head& other : columns) {
    if (name.starts_with(other.name + "/")) name[other.name.size()] = '.';
  }
  return name;
}

// Texts that repeat: numbers into the attribute "names", counted from 0.
void write_choices(const Handle& file, const std::string& path, const std::vector<int>& values,
                   const std::vector<std::string>& names, const StudyTable::Head& head, int order) {
  const Handle dataset = hdf5::write_dataset(file, path, H5T_STD_I32LE, H5T_NATIVE_INT, {values.size()}, values.data());
  describe(dataset, head.unit, head.description, order);
  write_attribute(dataset, "names", names);
}

void write_axes(const Handle& file, const StudyTable& table) {
  std::vector<std::size_t> sizes;
  for (const StudyAxis& axis : table.axes) sizes.push_back(axis.values.size());
  for (std::size_t a = 0; a < table.axes.size(); ++a) {
    const StudyAxis& axis = table.axes[a];
    const std::string path = "axes/" + axis.name;
    std::vector<double> numbers;
    std::vector<int> choices;
    for (const CaseRow& row : table.rows) {
      const std::size_t at = grid_position(sizes, row.index)[a];
      numbers.push_back(axis.values[at].number);
      choices.push_back(static_cast<int>(at));
    }
    const StudyTable::Head head{axis.name, axis.unit, axis.description};
    if (axis.is_numeric) {
      write_numbers(file, path, numbers, head, static_cast<int>(a));
      continue;
    }
    std::vector<std::string> labels;
    for (const AxisValue& value : axis.values) labels.push_back(value.label);
    write_choices(file, path, choices, labels, head, static_cast<int>(a));
  }
}

void write_outcomes(const Handle& file, const StudyTable& table) {
  std::vector<int> status;
  std::vector<std::string> reasons;
  for (const CaseRow& row : table.rows) {
    status.push_back(static_cast<int>(row.status));
    reasons.push_back(row.reason);
  }
  write_choices(file, "status", status,
                {name_of(CaseStatus::ok), name_of(CaseStatus::failed), name_of(CaseStatus::unreachable)},
                {"status", "1", "how the point ended, counted from 0 in the attribute names"}, 0);
  const Handle dataset = hdf5::write_strings(file, "reason", reasons);
  describe(dataset, "", "why a point has failed or cannot be reached", 0);
}

std::string image_of(const StudyTable& table, const std::string& version) {
  const hdf5::Session session;
  const Handle file = hdf5::create_in_memory("study");
  {
    const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, "/");
    write_attribute(root, "schema", std::string("grapnel-study-table/1"));
    write_attribute(root, "version", version);
    write_attribute(root, "study", table.study_name);
    write_attribute(root, "sha256", table.sha256);
    write_attribute(root, "simulate", std::string(name_of(table.mode)));
    // Attributes hold 64 KiB at most, a study's text may be longer.
    const Handle text = hdf5::write_strings(file, "study_text", {table.study_text});
    describe(text, "", "the study file", 0);
    write_axes(file, table);
    write_outcomes(file, table);
    int order = 0;
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      std::vector<double> values;
      for (const CaseRow& row : table.rows) values.push_back(row.values[c]);
      write_numbers(file, "columns/" + dataset_name(table.columns, c), values, table.columns[c], order++);
    }
  }
  return hdf5::image_of(file);
}

}  // namespace

void write_study_hdf5(const StudyTable& table, const std::string& version, const std::filesystem::path& path) {
  std::string image;
  try {
    image = image_of(table, version);
    seal(image);
  } catch (const std::exception& e) {
    throw std::runtime_error("cannot write " + path.string() + ": " + e.what());
  }
  write_file_atomically(path, image);
}

}  // namespace grapnel
