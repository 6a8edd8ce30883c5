// The status document: ports, connections, who is active, who wins, and the counters, as JSON.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "service/models/board.hpp"
#include "service/models/history.hpp"
#include "service/ports/refusals.hpp"
#include "service/ports/switchboard.hpp"
#include "service/takeover/deaths.hpp"
#include "service/takeover/strangers.hpp"
#include "wire/status.hpp"

namespace arbiter::service {

struct StatusOf {
  const std::string& instance;
  const Board& models;
  const Library& library;
  const ModelPointer& model;  // in force; null: none, or a predecessor's
  const History& history;
  const PortNames& names;
  const Registry& registry;
  const Switchboard& switchboard;
  const Strangers& strangers;
  const Deaths& deaths;
  const Refusals& refusals;
  std::size_t clients = 0;
  std::uint64_t reloads_refused = 0;
  std::optional<wire::RefusedFilesStatus> refused;  // of `model`, where that is a predecessor's
};

// Reads segments that others are writing; every value is right for some moment of the call.
std::string status_document(const StatusOf& of, shm::Nanoseconds now);

}  // namespace arbiter::service
