// How another model, and another policy, come into force.
#include "service/daemon.hpp"
#include "service/log.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {

void Daemon::reload(ClientId asking, std::uint64_t request) {
  reloads_asked_.push_back({asking, request});
  reload();
}

// The new table is written and its clients are told before it counts; they switch all at once.
void Daemon::reload() {
  if (swapping_ || phase_ != Phase::kServing) {
    reload_wanted_ = true;
    return;
  }
  reloads_running_ = std::exchange(reloads_asked_, {});
  try {
    if (!models_.has_files() && !gate_.has_file()) {
      throw std::runtime_error("there is no file to read again; start with --model");
    }
    gate_.prepare();
    if (models_.has_files()) {
      models_.read();
      models_.prepare();
    }
  } catch (const std::exception& error) {
    ++reloads_refused_;
    log::error("the model in force stays: {}", error.what());
    answer_reloads(error.what());
    return;
  }
  if (!models_.has_files()) {
    gate_.put_in_force();
    answer_reloads({});
    return;
  }
  begin_swap();
}

void Daemon::begin_swap() {
  swapping_ = true;
  auto told = switchboard_.link_all(models_.prepared());
  // The table itself, all who will read it have to map.
  for (const auto& [id, client] : clients_) {
    if (!client->ports.empty()) told.insert(client.get());
  }
  introduce(told, [this] { put_in_force(); });
}

void Daemon::put_in_force() {
  gate_.put_in_force();
  models_.put_in_force();
  swapping_ = false;
  const auto snapshot = models_.in_force();
  introduce(switchboard_.link_all(snapshot.table), [] {});  // ports that were opened meanwhile
  switchboard_.unlink(snapshot.table);
  switchboard_.ring_all();
  for (const auto& [id, client] : clients_) {
    if (client->observes) switchboard_.show_everything(*client);
  }
  log::info("model {} is in force", snapshot.generation);
  welcome_waiting();
  answer_reloads({});
}

void Daemon::answer_reloads(const std::string& why_not) {
  for (const ReloadRequest& each : std::exchange(reloads_running_, {})) {
    const auto client = clients_.find(each.client);
    if (client == clients_.end()) continue;
    if (!why_not.empty()) {
      refuse(*client->second, each.request, why_not);
      continue;
    }
    auto reply = reply_to(each.request, shm::MessageKind::kDone);
    reply.value = static_cast<std::uint32_t>(models_.in_force().generation);
    client->second->send(reply);
  }
}

}  // namespace arbiter::service
