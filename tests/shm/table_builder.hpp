// Decision tables written by hand, for tests that must not depend on the compiler of rules.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "shm/decision_table.hpp"

namespace arbiter::test {

class TableBuilder {
 public:
  struct Connection {
    shm::SourceId source = 0;
    shm::PortId port = 0;
    shm::Word kind = shm::table::kAlways;
    std::vector<shm::Word> reads;
    std::vector<shm::Word> nodes;  // three words each
    shm::Word root = 0;
    shm::Word before = shm::table::kTrue;
  };

  TableBuilder& timeout(shm::SourceId source, shm::Nanoseconds timeout) {
    timeouts_[source] = timeout;
    return *this;
  }
  // In document order, those of a port one after the other.
  TableBuilder& connect(Connection connection) {
    connections_.push_back(std::move(connection));
    return *this;
  }
  // The connection's rule is: all of `active`, none of `inactive`.
  TableBuilder& conjunction(shm::SourceId source, shm::PortId port,
                            const std::vector<shm::SourceId>& active,
                            const std::vector<shm::SourceId>& inactive) {
    Connection connection{source, port, shm::table::kConjunction, {}, {}, 0, shm::table::kTrue};
    for (const auto id : active) connection.reads.push_back(id | shm::table::kExpectActive);
    for (const auto id : inactive) connection.reads.push_back(id);
    return connect(std::move(connection));
  }

  [[nodiscard]] std::vector<shm::Word> words(shm::Word sources, shm::Word ports) const {
    using namespace shm::table;
    std::vector<shm::Word> words(kHeaderWords);
    words[kMagicAt] = kMagic;
    words[kVersionAt] = kVersion;
    put_span(words, kDefaultTimeoutLowAt, shm::kDefaultTimeout);
    words[kSourceCountAt] = sources;
    words[kSourcesAt] = kHeaderWords;
    words[kPortCountAt] = ports;
    words[kPortsAt] = words[kSourcesAt] + sources * kSourceWords;
    words[kConnectionCountAt] = static_cast<shm::Word>(connections_.size());
    words[kConnectionsAt] = words[kPortsAt] + ports * kPortWords;
    words.resize(words[kConnectionsAt] + connections_.size() * kConnectionWords);
    for (shm::Word id = 0; id < sources; ++id) add_source(words, id);
    for (shm::Word id = 0; id < ports; ++id) add_port(words, id);
    for (std::size_t i = 0; i < connections_.size(); ++i) add_connection(words, i);
    words[kTotalWordsAt] = static_cast<shm::Word>(words.size());
    return words;
  }

 private:
  static void put_span(std::vector<shm::Word>& words, std::size_t at, shm::Nanoseconds span) {
    words[at] = static_cast<shm::Word>(span);
    words[at + 1] = static_cast<shm::Word>(static_cast<std::uint64_t>(span) >> 32);
  }
  static void add_list(std::vector<shm::Word>& words, std::size_t at,
                       const std::vector<shm::Word>& list, std::size_t unit = 1) {
    words[at] = static_cast<shm::Word>(words.size());
    words[at + 1] = static_cast<shm::Word>(list.size() / unit);
    words.insert(words.end(), list.begin(), list.end());
  }
  void add_source(std::vector<shm::Word>& words, shm::Word id) const {
    using namespace shm::table;
    const std::size_t record = words[kSourcesAt] + std::size_t{id} * kSourceWords;
    words[record + kSourceKnown] = 1;
    const auto own = timeouts_.find(id);
    put_span(words, record + kTimeoutLow,
             own == timeouts_.end() ? shm::kDefaultTimeout : own->second);
    std::vector<shm::Word> links, concerned;
    for (shm::Word i = 0; i < connections_.size(); ++i) {
      const Connection& connection = connections_[i];
      if (connection.source == id) links.push_back(i);
      bool concerns = connection.source == id;
      for (const auto read : connection.reads) concerns |= (read & ~kExpectActive) == id;
      if (concerns) concerned.push_back(connection.port);
    }
    add_list(words, record + kFirstLink, links);
    add_list(words, record + kFirstConcerned, concerned);
  }
  void add_port(std::vector<shm::Word>& words, shm::Word id) const {
    using namespace shm::table;
    const std::size_t record = words[kPortsAt] + std::size_t{id} * kPortWords;
    words[record + kPortFlags] = kPortKnown | kPortArbitrated;
    std::vector<shm::Word> reads;
    for (shm::Word i = 0; i < connections_.size(); ++i) {
      if (connections_[i].port != id) continue;
      if (words[record + kPortConnectionCount]++ == 0) words[record + kFirstConnection] = i;
      for (const auto read : connections_[i].reads) reads.push_back(read & ~kExpectActive);
    }
    add_list(words, record + kFirstPortRead, reads);
  }
  void add_connection(std::vector<shm::Word>& words, std::size_t index) const {
    using namespace shm::table;
    const Connection& connection = connections_[index];
    const std::size_t record = words[kConnectionsAt] + index * kConnectionWords;
    words[record + kConnectionSource] = connection.source;
    words[record + kConnectionPort] = connection.port;
    words[record + kRuleKind] = connection.kind;
    words[record + kRoot] = connection.root;
    words[record + kBefore] = connection.before;
    add_list(words, record + kFirstRead, connection.reads);
    add_list(words, record + kFirstNode, connection.nodes, kNodeWords);
  }

  std::map<shm::SourceId, shm::Nanoseconds> timeouts_;
  std::vector<Connection> connections_;
};

// The words as a reader sees them. On the heap, in exactly their size, so that the address
// sanitizer sees each step outside.
class TableWords {
 public:
  explicit TableWords(const std::vector<shm::Word>& words) : words_(words.size()) {
    for (std::size_t i = 0; i < words.size(); ++i) words_[i] = words[i];
  }
  [[nodiscard]] shm::TableView view() const {
    return {words_.data(), static_cast<shm::Word>(words_.size())};
  }
  [[nodiscard]] std::size_t size() const { return words_.size(); }
  shm::Atomic<shm::Word>& operator[](std::size_t i) { return words_[i]; }

 private:
  std::vector<shm::Atomic<shm::Word>> words_;
};

}  // namespace arbiter::test
