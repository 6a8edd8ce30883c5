#include "rules/prove/flatten.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "rules/prove/in_order.hpp"

namespace arbiter::rules {
namespace {

namespace table = shm::table;
using shm::Word;

Word to_word(std::size_t value) { return static_cast<Word>(value); }

// The arbitrated ports that each source is connected to or that read it, in byte order.
std::map<std::string, std::vector<std::string>> ports_concerned(const CompiledModel& model) {
  std::map<std::string, std::vector<std::string>> result;
  for (const auto& port : model.ports) {
    if (!port.arbitrated) continue;
    std::set<std::string> sources(port.reads.begin(), port.reads.end());
    for (const auto& rule : port.rules) sources.insert(rule.source);
    for (const auto& source : sources) result[source].push_back(port.port);
  }
  return result;
}

std::size_t words_in_lists(const CompiledModel& model) {
  std::size_t words = 0;
  for (const auto& port : model.ports) {
    words += port.reads.size();
    for (const auto& rule : port.rules) {
      words +=
          table::kConnectionWords + 1 + rule.reads.size() + rule.nodes.size() * table::kNodeWords;
    }
    if (port.in_order) {
      words += shm::kMaxSourcesPerPort + nodes_in_order(port) * table::kNodeWords;
    }
  }
  for (const auto& [source, ports] : ports_concerned(model)) words += ports.size();
  return words;
}

class Flattener {
 public:
  Flattener(const CompiledModel& model, const TableIds& ids) : model_(model), ids_(ids) {}

  std::vector<Word> flatten();

 private:
  [[nodiscard]] shm::SourceId source_id(const std::string& source) const;
  [[nodiscard]] shm::PortId port_id(const std::string& port) const;
  void lay_out_records();
  void write_header();
  void write_sources();
  void write_ports();
  void write_rules(const CompiledPort& port, shm::PortId id, Word first_connection);
  void write_rule(Word record, const CompiledRule& rule);
  void write_span(Word at, shm::Nanoseconds span);

  // Opens a list at the table's end: writes {first, count} into the record's field.
  void begin_list(Word field, std::size_t count);
  // Writes a list, or leads to an equal one: rules that are the same are seen to be.
  Word share(const std::vector<Word>& list);
  Word share(const std::vector<CompiledRule::Node>& nodes);
  void refer(Word field, Word first, std::size_t count);
  void append(Word word) { words_.push_back(word); }

  const CompiledModel& model_;
  const TableIds& ids_;
  std::vector<Word> words_;
  Word source_count_ = 0, port_count_ = 0, connection_count_ = 0;
  Word sources_ = 0, ports_ = 0, connections_ = 0;
  std::map<std::string, std::vector<shm::ConnectionIndex>> links_;  // by source
  std::map<std::vector<Word>, Word> shared_;                        // where each list begins
};

shm::SourceId Flattener::source_id(const std::string& source) const {
  const shm::SourceId id = ids_.source(source);
  if (id >= shm::kMaxSources) throw std::length_error("more sources than kMaxSources");
  return id;
}

shm::PortId Flattener::port_id(const std::string& port) const {
  const shm::PortId id = ids_.port(port);
  if (id >= shm::kMaxInputPorts) throw std::length_error("more input ports than kMaxInputPorts");
  return id;
}

std::vector<Word> Flattener::flatten() {
  lay_out_records();
  write_header();
  write_ports();
  write_sources();
  if (words_.size() > shm::kMaxTableWords) {
    throw std::length_error("the decision table has " + std::to_string(words_.size()) +
                            " words, more than kMaxTableWords (" +
                            std::to_string(shm::kMaxTableWords) + ")");
  }
  words_[table::kTotalWordsAt] = to_word(words_.size());
  return std::move(words_);
}

void Flattener::lay_out_records() {
  for (const auto& source : model_.sources) {
    source_count_ = std::max(source_count_, source_id(source) + 1);
  }
  for (const auto& port : model_.ports) {
    port_count_ = std::max(port_count_, port_id(port.port) + 1);
    connection_count_ += to_word(port.rules.size());
  }
  sources_ = table::kHeaderWords;
  ports_ = sources_ + source_count_ * table::kSourceWords;
  connections_ = ports_ + port_count_ * table::kPortWords;
  words_.resize(connections_ + connection_count_ * table::kConnectionWords);
}

void Flattener::write_header() {
  words_[table::kMagicAt] = table::kMagic;
  words_[table::kVersionAt] = table::kVersion;
  write_span(table::kDefaultTimeoutLowAt, model_.timeout);
  words_[table::kSourceCountAt] = source_count_;
  words_[table::kSourcesAt] = sources_;
  words_[table::kPortCountAt] = port_count_;
  words_[table::kPortsAt] = ports_;
  words_[table::kConnectionCountAt] = connection_count_;
  words_[table::kConnectionsAt] = connections_;
}

void Flattener::write_span(Word at, shm::Nanoseconds span) {
  static_assert(table::kDefaultTimeoutHighAt == table::kDefaultTimeoutLowAt + 1 &&
                table::kTimeoutHigh == table::kTimeoutLow + 1);
  const auto bits = static_cast<std::uint64_t>(span);
  words_[at] = static_cast<Word>(bits & std::numeric_limits<Word>::max());
  words_[at + 1] = static_cast<Word>(bits >> 32);
}

void Flattener::begin_list(Word field, std::size_t count) {
  words_[field] = to_word(words_.size());
  words_[field + 1] = to_word(count);
}

Word Flattener::share(const std::vector<Word>& list) {
  const auto [known, is_new] = shared_.try_emplace(list, to_word(words_.size()));
  if (is_new) words_.insert(words_.end(), list.begin(), list.end());
  return known->second;
}

Word Flattener::share(const std::vector<CompiledRule::Node>& nodes) {
  std::vector<Word> list;
  for (const auto& node : nodes) list.insert(list.end(), {node.position, node.low, node.high});
  return share(list);
}

void Flattener::refer(Word field, Word first, std::size_t count) {
  words_[field] = first;
  words_[field + 1] = to_word(count);
}

void Flattener::write_ports() {
  Word connection = 0;
  for (const auto& port : model_.ports) {
    const shm::PortId id = port_id(port.port);
    const Word record = ports_ + id * table::kPortWords;
    words_[record + table::kPortFlags] =
        table::kPortKnown | (port.arbitrated ? Word{table::kPortArbitrated} : Word{0});
    words_[record + table::kFirstConnection] = connection;
    words_[record + table::kPortConnectionCount] = to_word(port.rules.size());
    begin_list(record + table::kFirstPortRead, port.reads.size());
    for (const auto& source : port.reads) append(source_id(source));
    write_rules(port, id, connection);
    for (const auto& rule : port.rules) links_[rule.source].push_back(connection++);
  }
}

void Flattener::write_rules(const CompiledPort& port, shm::PortId id, Word first_connection) {
  InOrder in_order;
  Word first_read = 0, first_node = 0;
  if (port.in_order) {
    in_order = put_in_order(port);
    std::vector<Word> reads;
    for (const auto& read : in_order.reads) reads.push_back(source_id(read));
    first_read = share(reads);
    first_node = share(in_order.nodes);
  }
  for (std::size_t i = 0; i < port.rules.size(); ++i) {
    const CompiledRule& rule = port.rules[i];
    const Word record =
        connections_ + (first_connection + to_word(i)) * Word{table::kConnectionWords};
    words_[record + table::kConnectionSource] = source_id(rule.source);
    words_[record + table::kConnectionPort] = id;
    words_[record + table::kBefore] = table::kTrue;
    if (!port.in_order || rule.kind == table::kNever ||
        in_order.entries[i].before == table::kTrue) {
      write_rule(record, rule);
      continue;
    }
    const InOrder::Entry& entry = in_order.entries[i];
    words_[record + table::kRuleKind] = table::kInOrder;
    words_[record + table::kRoot] = entry.root;
    words_[record + table::kBefore] = entry.before;
    refer(record + table::kFirstRead, first_read, entry.reads);
    refer(record + table::kFirstNode, first_node, in_order.nodes.size());
  }
}

void Flattener::write_rule(Word record, const CompiledRule& rule) {
  words_[record + table::kRuleKind] = rule.kind;
  std::vector<Word> reads;
  for (std::size_t i = 0; i < rule.reads.size(); ++i) {
    const bool expect_active = rule.kind == table::kConjunction && rule.expected[i];
    reads.push_back(source_id(rule.reads[i]) | (expect_active ? table::kExpectActive : Word{0}));
  }
  refer(record + table::kFirstRead, share(reads), rule.reads.size());
  refer(record + table::kFirstNode, share(rule.nodes), rule.nodes.size());
}

void Flattener::write_sources() {
  auto concerned = ports_concerned(model_);
  for (const auto& source : model_.sources) {
    const Word record = sources_ + source_id(source) * table::kSourceWords;
    words_[record + table::kSourceKnown] = 1;
    write_span(record + table::kTimeoutLow, model_.timeout_of(source));
    const auto& links = links_[source];
    begin_list(record + table::kFirstLink, links.size());
    for (const shm::ConnectionIndex link : links) append(link);
    const auto& ports = concerned[source];
    begin_list(record + table::kFirstConcerned, ports.size());
    for (const auto& port : ports) append(port_id(port));
  }
}

}  // namespace

std::size_t largest_table(const CompiledModel& model) {
  return table::kHeaderWords + std::size_t{shm::kMaxSources} * table::kSourceWords +
         std::size_t{shm::kMaxInputPorts} * table::kPortWords + words_in_lists(model);
}

std::vector<Word> flatten(const CompiledModel& model, const TableIds& ids) {
  return Flattener(model, ids).flatten();
}

}  // namespace arbiter::rules
