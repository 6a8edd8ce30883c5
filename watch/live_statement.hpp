// Whether a statement (rules/model/statement.hpp) is true of a running instance at this moment.
//
// `arbiter check --assert` proves statements of every state of the sources; here the state is the
// one that decisions see. Names mean what they mean in the model in force. Who wins is who the
// rules select: a winner that cannot deliver is the winner nevertheless.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "rules/model/evaluation.hpp"
#include "rules/model/statement.hpp"
#include "rules/text/diagnostic.hpp"
#include "shm/ids.hpp"
#include "watch/instance.hpp"
#include "watch/picture.hpp"
#include "watch/port.hpp"

namespace arbiter::watch {

// The model in force does not have a name of the statement. The diagnostics say which.
class StatementError : public WatchError {
 public:
  StatementError(const std::string& message, rules::Diagnostics found)
      : WatchError(message), diagnostics_(std::move(found)) {}

  [[nodiscard]] const rules::Diagnostics& diagnostics() const { return diagnostics_; }

 private:
  rules::Diagnostics diagnostics_;
};

class LiveStatement {
 public:
  struct Look {
    // Unknown: no picture of one moment could be taken, a source's page has not come, or another
    // model has come into force and the daemon cannot be asked for its names. Look again.
    rules::Truth truth = rules::Truth::kUnknown;
    Picture picture;
    // What the statement speaks of, as far as it is known; nothing for a winner: nobody wins.
    std::map<std::string, std::optional<std::string>> winners;
    std::map<std::string, bool> active;
  };

  // Keeps the instance.
  LiveStatement(std::shared_ptr<Instance> instance, rules::Statement statement);

  // Reads memory. When another model, or another daemon's memory, has come since the last look, it
  // first asks the daemon, once, to send all names. Throws StatementError; WatchError if no model
  // is in force; wire::CallError if the daemon refuses.
  Look look();

  // Warnings about the statement under the model of the last look.
  [[nodiscard]] const rules::Diagnostics& diagnostics() const { return diagnostics_; }
  // Of the model of the last look.
  [[nodiscard]] std::uint64_t generation() const { return generation_; }

 private:
  struct Term {
    shm::PortId port = shm::kNone;
    std::optional<shm::PortId> other{};  // the winner is the same there
    std::set<shm::SourceId> sources{};   // or one of these wins; none: nobody does
    bool nobody = false;
  };

  [[nodiscard]] bool is_bound() const;
  bool bind();
  void bind_names(const shm::TableView& table);
  [[nodiscard]] Term bind_term(const shm::TableView& table, const rules::WinnerTerm& term) const;
  [[nodiscard]] rules::Truth evaluate(const Picture& picture) const;
  [[nodiscard]] rules::Truth evaluate(const Term& term, const Picture& picture) const;
  void describe(Look& look) const;

  const std::shared_ptr<Instance> instance_;
  const rules::Statement statement_;
  // What follows is of this memory and generation.
  std::shared_ptr<const shm::DecisionMemory> memory_;
  std::uint64_t generation_ = 0;
  rules::Diagnostics diagnostics_;
  rules::ExpressionPtr expression_;  // quantifiers expanded
  std::vector<Term> terms_;
  std::map<std::string, shm::SourceId> sources_;  // that it names, patterns expanded
  std::map<std::string, shm::PortId> ports_;      // that it names
  std::vector<shm::SourceId> read_;               // by it, or at these ports
};

}  // namespace arbiter::watch
