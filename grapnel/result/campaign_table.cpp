#include "grapnel/result/campaign_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <functional>
#include <optional>
#include <stdexcept>

#include "grapnel/result/child_reader.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using hdf5::check;
using hdf5::Handle;

constexpr const char* kTableSchema = "grapnel-campaign-table/1";

Handle open_table(const fs::path& path) {
  std::array<char, 8> begin{};
  std::ifstream stream(path, std::ios::binary);
  if (!stream.read(begin.data(), begin.size()) || std::string_view(begin.data(), begin.size()) != "\x89HDF\r\n\x1a\n")
    throw std::runtime_error("not an HDF5 file");
  check_file_seal(path);  // before HDF5 opens it: HDF5 can loop endlessly on a damaged file
  return hdf5::open_on_disk(path);
}

struct OrderedHead {
  int order = 0;
  CampaignTable::Head head;
};

// State of the visit of a group's datasets: an exception must not pass through C.
struct Visit {
  hid_t file;
  std::string group;
  std::vector<OrderedHead> found;
  std::string fault;
};

herr_t visit_dataset(hid_t, const char* name, const H5O_info_t* info, void* data) {
  if (info->type != H5O_TYPE_DATASET) return 0;
  auto& visit = *static_cast<Visit*>(data);
  const std::string path = visit.group + "/" + name;
  try {
    const Handle dataset(H5Dopen2(visit.file, path.c_str(), H5P_DEFAULT), H5Dclose, path);
    CampaignTable::Head head{hdf5::read_string_attribute(dataset, "name"), hdf5::read_string_attribute(dataset, "unit"),
                             hdf5::read_string_attribute(dataset, "description")};
    if (H5Aexists(dataset.id(), "names") > 0) head.labels = hdf5::read_strings_attribute(dataset, "names");
    head.dataset = path;
    const int order = hdf5::read_int_attribute(dataset, "order", static_cast<int>(visit.found.size()));
    visit.found.push_back({order, std::move(head)});
    return 0;
  } catch (const std::exception& e) {
    visit.fault = e.what();
    return -1;
  }
}

// The question of the parent, and the number type of the answer (memory_type()).
enum class Ask : char { heads = 'h', numbers = 'n', texts = 't' };

template <class Number>
constexpr char letter_of() {
  if constexpr (std::is_same_v<Number, double>) return 'd';
  if constexpr (std::is_same_v<Number, float>) return 'f';
  if constexpr (std::is_same_v<Number, std::uint64_t>) return 'u';
  if constexpr (std::is_same_v<Number, std::int32_t>) return 'i';
  if constexpr (std::is_same_v<Number, std::uint8_t>) return 'b';
}

template <class Number>
hid_t memory_type() {
  if constexpr (std::is_same_v<Number, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<Number, float>) return H5T_NATIVE_FLOAT;
  if constexpr (std::is_same_v<Number, std::uint64_t>) return H5T_NATIVE_UINT64;
  if constexpr (std::is_same_v<Number, std::int32_t>) return H5T_NATIVE_INT32;
  if constexpr (std::is_same_v<Number, std::uint8_t>) return H5T_NATIVE_UINT8;
}

void send_heads(ToParent& parent, const std::vector<CampaignTable::Head>& heads) {
  parent.count(heads.size());
  for (const CampaignTable::Head& head : heads) {
    for (const std::string* text : {&head.name, &head.unit, &head.description, &head.dataset}) parent.text(*text);
    parent.texts(head.labels);
  }
}

std::vector<CampaignTable::Head> take_heads(FromChild& child) {
  constexpr std::uint64_t kMost = 1 << 20;
  const std::uint64_t count = child.count();
  if (count > kMost) throw std::runtime_error("damaged: implausible number of columns");
  std::vector<CampaignTable::Head> heads;
  for (std::uint64_t i = 0; i < count; ++i) {
    CampaignTable::Head head;
    for (std::string* text : {&head.name, &head.unit, &head.description, &head.dataset}) *text = child.text();
    head.labels = child.texts();
    heads.push_back(std::move(head));
  }
  return heads;
}

// --- In the child: HDF5, which can crash or loop on a damaged file ---

// The parts of a question, in order.
class Question {
 public:
  explicit Question(const std::string& bytes) : bytes_(bytes) {}
  char letter() {
    const char letter = at_ < bytes_.size() ? bytes_[at_] : '\0';
    ++at_;
    return letter;
  }
  std::uint64_t number() {
    std::uint64_t value = 0;
    if (at_ + sizeof value > bytes_.size()) throw std::runtime_error("a question is truncated");
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  bool is_at_end() const { return at_ >= bytes_.size(); }
  std::string rest() const { return bytes_.substr(std::min(at_, bytes_.size())); }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

std::string number_bytes(std::uint64_t value) { return {reinterpret_cast<const char*>(&value), sizeof value}; }

struct OpenTable {
  std::uintmax_t bytes = 0;
  std::optional<Handle> file;
  std::string sha256;
  std::vector<std::string> status_names;
  std::uint64_t rows = 0;
  std::vector<CampaignTable::Head> design, inputs, columns;

  explicit OpenTable(const fs::path& path) : bytes(fs::file_size(path)) {
    file.emplace(open_table(path));
    open();
  }

  void answer(const std::string& bytes_of_question, ToParent& parent) const {
    Question question(bytes_of_question);
    switch (static_cast<Ask>(question.letter())) {
      case Ask::heads:
        parent.text(sha256);
        parent.texts(status_names);
        parent.count(rows);
        for (const auto* heads : {&design, &inputs, &columns}) send_heads(parent, *heads);
        return;
      case Ask::numbers:
        return send_numbers(question, parent);
      case Ask::texts: {
        std::vector<hsize_t> places;
        while (!question.is_at_end()) places.push_back(question.number());
        return parent.texts(texts("reasons", places));
      }
    }
  }

  void send_numbers(Question& question, ToParent& parent) const {
    const char letter = question.letter();
    const std::uint64_t first = question.number(), count = question.number();
    const std::string name = question.rest();
    const auto send = [&]<class Number>(Number) {
      check_length(name);
      if (first > rows || count > rows - first) throw std::runtime_error("rows beyond the table's end");
      std::vector<Number> values(count);
      read(name, memory_type<Number>(), first, count, values.data());
      parent.numbers(values);
    };
    if (letter == letter_of<double>()) send(double{});
    if (letter == letter_of<float>()) send(float{});
    if (letter == letter_of<std::uint64_t>()) send(std::uint64_t{});
    if (letter == letter_of<std::int32_t>()) send(std::int32_t{});
    if (letter == letter_of<std::uint8_t>()) send(std::uint8_t{});
  }

  void open() {
    const Handle root(H5Gopen2(file->id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
    const std::string schema = hdf5::read_string_attribute(root, "schema");
    if (schema != kTableSchema) throw std::runtime_error(fmt::format("schema is '{}', not {}", schema, kTableSchema));
    sha256 = hdf5::read_string_attribute(root, "sha256");
    status_names = hdf5::read_strings_attribute(dataset("status"), "names");
    rows = length_of("k");
    design = heads_in("design"), inputs = heads_in("inputs"), columns = heads_in("columns");
  }

  std::vector<CampaignTable::Head> heads_in(const std::string& group) const {
    if (H5Lexists(file->id(), group.c_str(), H5P_DEFAULT) <= 0) return {};
    const Handle opened(H5Gopen2(file->id(), group.c_str(), H5P_DEFAULT), H5Gclose, group);
    Visit visit{file->id(), group, {}, ""};
    const herr_t status = H5Ovisit2(opened.id(), H5_INDEX_NAME, H5_ITER_INC, visit_dataset, &visit, H5O_INFO_BASIC);
    if (!visit.fault.empty()) throw std::runtime_error(visit.fault);
    check(status, "damaged: group '" + group + "'");
    std::stable_sort(visit.found.begin(), visit.found.end(),
                     [](const OrderedHead& a, const OrderedHead& b) { return a.order < b.order; });
    std::vector<CampaignTable::Head> heads;
    for (OrderedHead& found : visit.found) {
      check_length(found.head.dataset);
      heads.push_back(std::move(found.head));
    }
    return heads;
  }

  Handle dataset(const std::string& name) const {
    return {H5Dopen2(file->id(), name.c_str(), H5P_DEFAULT), H5Dclose, "no dataset '" + name + "'"};
  }

  std::uint64_t length_of(const std::string& name) const {
    const Handle opened = dataset(name), space(H5Dget_space(opened.id()), H5Sclose, name);
    hsize_t length = 0;
    if (H5Sget_simple_extent_ndims(space.id()) != 1 || H5Sget_simple_extent_dims(space.id(), &length, nullptr) < 0)
      throw std::runtime_error("damaged: '" + name + "' is not a list");
    // Deflate gains a factor of 1032 at most: larger claims are damage, and must not exhaust the memory.
    if (static_cast<double>(length) > 1100.0 * static_cast<double>(bytes))
      throw std::runtime_error("damaged: '" + name + "' declares more data than the file can hold");
    return length;
  }
  void check_length(const std::string& name) const {
    if (length_of(name) != rows) throw std::runtime_error("damaged: '" + name + "' has another length than 'k'");
  }

  void read(const std::string& name, hid_t type, std::uint64_t first, std::uint64_t count, void* out) const {
    if (count == 0) return;
    const Handle opened = dataset(name), on_disk(H5Dget_space(opened.id()), H5Sclose, name);
    const hsize_t begin = first, size = count;
    check(H5Sselect_hyperslab(on_disk.id(), H5S_SELECT_SET, &begin, nullptr, &size, nullptr), name);
    const Handle in_memory(H5Screate_simple(1, &size, nullptr), H5Sclose, name);
    check(H5Dread(opened.id(), type, in_memory.id(), on_disk.id(), H5P_DEFAULT, out), "damaged: '" + name + "'");
  }

  // The texts at some places of a list of texts.
  std::vector<std::string> texts(const std::string& name, const std::vector<hsize_t>& places) const {
    const hsize_t length = length_of(name), count = places.size();
    for (const hsize_t place : places)
      if (place >= length) throw std::runtime_error(fmt::format("damaged: '{}' has no text number {}", name, place));
    if (places.empty()) return {};
    const Handle opened = dataset(name), on_disk(H5Dget_space(opened.id()), H5Sclose, name);
    check(H5Sselect_elements(on_disk.id(), H5S_SELECT_SET, places.size(), places.data()), name);
    const Handle in_memory(H5Screate_simple(1, &count, nullptr), H5Sclose, name);
    const Handle stored(H5Dget_type(opened.id()), H5Tclose, name);
    if (H5Tis_variable_str(stored.id()) <= 0)
      throw std::runtime_error("damaged: '" + name + "' does not contain texts");
    const Handle type = hdf5::string_type(H5Tget_cset(stored.id()) == H5T_CSET_ASCII);
    std::vector<char*> raw(places.size(), nullptr);
    check(H5Dread(opened.id(), type.id(), in_memory.id(), on_disk.id(), H5P_DEFAULT, raw.data()),
          "damaged: '" + name + "'");
    std::vector<std::string> texts;
    for (const char* text : raw) texts.emplace_back(text ? text : "");
    H5Dvlen_reclaim(type.id(), in_memory.id(), H5P_DEFAULT, raw.data());
    return texts;
  }
};

}  // namespace

// --- In the parent: data from the child ---

struct CampaignTable::File {
  fs::path path;
  std::unique_ptr<QueriedChild> child;
  std::string sha256;
  std::vector<std::string> status_names;
  std::uint64_t rows = 0;
  std::vector<Head> design, inputs, columns;

  std::runtime_error fault(const std::string& what) const {
    return std::runtime_error("cannot read " + path.string() + ": " + what);
  }

  /// All failures become one error that names the file.
  void ask(const std::string& question, const std::function<void(FromChild&)>& take) const {
    try {
      child->ask(question, take);
    } catch (const std::exception& e) {
      throw fault(e.what());
    }
  }

  void open() {
    try {
      std::error_code error;
      if (!fs::is_regular_file(path, error))
        throw std::runtime_error(fs::exists(path, error) ? "not a file" : "no such file");
      const std::uintmax_t size = fs::file_size(path, error);
      if (error) throw std::runtime_error(error.message());
      const hdf5::Session session;  // the child inherits the state of HDF5: no other thread may be using it
      child = std::make_unique<QueriedChild>(reading_seconds(static_cast<double>(size)), [this] {
        const auto table = std::make_shared<const OpenTable>(path);
        return [table](const std::string& question, ToParent& parent) { table->answer(question, parent); };
      });
    } catch (const std::exception& e) {
      throw fault(e.what());
    }
    ask({static_cast<char>(Ask::heads)}, [this](FromChild& from) {
      sha256 = from.text();
      status_names = from.texts();
      rows = from.count();
      for (auto* heads : {&design, &inputs, &columns}) *heads = take_heads(from);
    });
  }

  template <class Number>
  std::vector<Number> numbers(const std::string& name, std::uint64_t first, std::uint64_t count) const {
    const std::string question = std::string{static_cast<char>(Ask::numbers), letter_of<Number>()} +
                                 number_bytes(first) + number_bytes(count) + name;
    std::vector<Number> values;
    ask(question, [&](FromChild& from) {
      values = from.numbers<Number>();
      if (values.size() != count) throw std::runtime_error("damaged: '" + name + "' has another length than 'k'");
    });
    return values;
  }
  template <class Number>
  std::vector<Number> all(const std::string& name) const {
    return numbers<Number>(name, 0, rows);
  }
};

CampaignTable::CampaignTable(const fs::path& table) : file_(std::make_unique<File>()) {
  file_->path = table;
  file_->open();
}

CampaignTable::~CampaignTable() = default;

const std::vector<CampaignTable::Head>& CampaignTable::design() const { return file_->design; }
const std::vector<CampaignTable::Head>& CampaignTable::inputs() const { return file_->inputs; }
const std::vector<CampaignTable::Head>& CampaignTable::columns() const { return file_->columns; }
std::uint64_t CampaignTable::rows() const { return file_->rows; }
const std::string& CampaignTable::sha256() const { return file_->sha256; }
std::runtime_error CampaignTable::fault(const std::string& what) const { return file_->fault(what); }

template <class Number>
std::vector<Number> CampaignTable::numbers(const Head& head) const {
  return file_->all<Number>(head.dataset);
}
template std::vector<double> CampaignTable::numbers(const Head& head) const;
template std::vector<float> CampaignTable::numbers(const Head& head) const;

void CampaignTable::read(const Head& head, std::uint64_t first, std::span<double> out) const {
  const std::vector<double> values = file_->numbers<double>(head.dataset, first, out.size());
  std::copy(values.begin(), values.end(), out.begin());
}

std::vector<std::uint64_t> CampaignTable::indices() const { return file_->all<std::uint64_t>("k"); }
std::vector<std::uint8_t> CampaignTable::status() const { return file_->all<std::uint8_t>("status"); }
const std::vector<std::string>& CampaignTable::status_names() const { return file_->status_names; }
std::vector<std::uint8_t> CampaignTable::success() const { return file_->all<std::uint8_t>("success"); }
std::vector<std::int32_t> CampaignTable::reasons() const { return file_->all<std::int32_t>("reason"); }

std::vector<std::string> CampaignTable::reason_texts(const std::vector<std::int32_t>& numbers) const {
  std::string question{static_cast<char>(Ask::texts)};
  for (const std::int32_t number : numbers) {
    if (number < 0) throw fault("damaged: 'reason' has a negative number");
    question += number_bytes(static_cast<std::uint64_t>(number));
  }
  std::vector<std::string> texts;
  file_->ask(question, [&](FromChild& from) {
    texts = from.texts();
    if (texts.size() != numbers.size()) throw std::runtime_error("damaged: texts of reasons are missing");
  });
  return texts;
}

}  // namespace grapnel
