#include "service/takeover/strangers.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace arbiter::service {
namespace {

void add(std::set<std::string>& ports, const std::string& port) {
  if (ports.size() < Strangers::kMaxPorts) ports.insert(port);
}

}  // namespace

bool Strangers::refuse(const Client& client, NodeId former, const std::string& why,
                       shm::Nanoseconds now) {
  auto found = std::find_if(known_.begin(), known_.end(), [&](const Known& each) {
    return each.former == former && each.stranger.node == client.name &&
           each.stranger.process == client.identity();
  });
  const bool is_new = found == known_.end();
  if (is_new) {
    make_room();
    Known known;
    known.former = former;
    known.stranger.process = client.identity();
    known.stranger.user = client.user();
    known.stranger.node = client.name;
    known.stranger.since = now;
    found = known_.insert(known_.end(), std::move(known));
  }
  found->conversation = client.id();
  found->outputs.clear();
  found->inputs.clear();
  found->stranger.seen = now;
  return std::exchange(found->stranger.why, why) != why || is_new;
}

Strangers::Known* Strangers::find(const Client& client) {
  const auto found = std::find_if(known_.begin(), known_.end(), [&](const Known& each) {
    return each.conversation == client.id();
  });
  return found == known_.end() ? nullptr : &*found;
}

void Strangers::has_output(const Client& client, const std::string& port) {
  if (Known* known = find(client)) add(known->outputs, port);
}

void Strangers::has_input(const Client& client, const std::string& port) {
  if (Known* known = find(client)) add(known->inputs, port);
}

// Until now what it said the last time has stood: nobody is to see half of it.
void Strangers::has_said_all(const Client& client) {
  Known* known = find(client);
  if (known == nullptr) return;
  known->stranger.outputs = std::move(known->outputs);
  known->stranger.inputs = std::move(known->inputs);
}

void Strangers::welcome(const Client& client) {
  std::erase_if(known_, [&](const Known& each) {
    return each.stranger.node == client.name && each.stranger.process == client.identity();
  });
}

void Strangers::make_room() {
  if (known_.size() < kMax) return;
  std::erase_if(known_, [](const Known& each) { return !each.stranger.process.lives(); });
  if (known_.size() < kMax) return;
  std::map<uid_t, std::size_t> counts;
  for (const Known& each : known_) ++counts[each.stranger.user];
  const auto rank = [&](const Known& each) {
    return std::pair(counts.at(each.stranger.user), -each.stranger.seen);
  };
  known_.erase(std::max_element(known_.begin(), known_.end(),
                                [&](const auto& a, const auto& b) { return rank(a) < rank(b); }));
}

std::vector<const Stranger*> Strangers::living() const {
  std::vector<const Stranger*> result;
  for (const Known& each : known_) {
    if (each.stranger.process.lives()) result.push_back(&each.stranger);
  }
  return result;
}

}  // namespace arbiter::service
