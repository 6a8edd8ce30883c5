// The answer of `arbiter why`: of one port, at one moment.
//
//   why_answer.cpp      what the answer contains, and in which order; JSON
//   why_port.cpp        about the port
//   why_connection.cpp  about a connection, or a source that is only sensed
#pragma once

#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/why_follow.hpp"
#include "rules/explain/explain.hpp"
#include "rules/explain/tenure.hpp"
#include "watch/obstacles.hpp"
#include "watch/port.hpp"
#include "wire/hosts.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {

class WhyAnswer {
 public:
  // Keeps references.
  WhyAnswer(const WhyOptions& options, const watch::Port& port, watch::Look look,
            rules::PortExplanation explanation, const wire::Status& status, watch::Fates fates,
            std::vector<std::string> also_open_on, std::ostream& out);

  // Throws Error where the source is none of this port's.
  void check_source(const wire::Status& status) const;
  void write_text() const;
  void write_json() const;

 private:
  [[nodiscard]] bool is_sensed(const std::string& source) const;
  // Of those that nobody has open, that never were active, and that keep nobody out, the names are
  // enough.
  [[nodiscard]] bool is_only_named(const std::string& source) const;
  // Of a port with many connections a part is told, which fits a screen.
  [[nodiscard]] bool is_large() const;
  [[nodiscard]] bool is_short(const rules::ConnectionExplanation& connection) const;
  void write_port() const;
  void write_model() const;
  [[nodiscard]] std::string since_text() const;
  [[nodiscard]] nlohmann::json since_json() const;
  void write_connection(const rules::ConnectionExplanation& connection) const;
  void write_selected(const rules::ConnectionExplanation& connection) const;
  void write_kept_out(const rules::ConnectionExplanation& connection) const;
  void write_reasons(const rules::ConnectionExplanation& connection) const;
  void write_sensed(const std::string& source) const;
  void write_senses() const;
  void write_only_named() const;
  // Of those that are not told of one by one.
  void write_rest(const std::vector<const rules::ConnectionExplanation*>& rest) const;
  [[nodiscard]] nlohmann::json component_json(const std::string& source) const;
  // "active (arrived …)", and who has it open.
  [[nodiscard]] std::string state_text(const std::string& source) const;

  std::ostream& out_;
  const WhyOptions& options_;
  const watch::Port& port_;
  const watch::Look look_;
  const rules::PortExplanation explanation_;
  const watch::Obstacles obstacles_;
  const std::vector<std::string> also_open_on_;  // hosts
  const bool is_open_;                           // here
  const rules::Tenure tenure_;
  std::vector<rules::ConnectionExplanation> shown_;  // as the model has them
  std::vector<std::string> reasons_;                 // sources that keep active connections out
};

// The whole answer to `options`. Of activities, and of who wins, it says what the kept picture has,
// if one is given; what the daemon's status knows is always of now. With `hosts` also what comes
// from other hosts, or came. `models`: as watch::Port has it. Throws as watch::Port does, and
// Error.
void write_why(std::ostream& out, const WhyOptions& options,
               const std::shared_ptr<watch::Instance>& instance,
               const watch::KeptPicture* kept = nullptr, const wire::HostsDocument* hosts = nullptr,
               std::shared_ptr<watch::ModelLoader> models = nullptr);

}  // namespace arbiter::cli
