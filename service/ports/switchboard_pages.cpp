// Which client has which activity pages, and the names that observers hear.
#include "service/ports/switchboard.hpp"

namespace arbiter::service {

// A publisher decides for every port that its source concerns, so it needs all that their rules
// read.
void Switchboard::send_pages(const OutputPort& output, const shm::TableView& table, Told& told) {
  const auto concerned = table.ports_concerned(output.source->id);
  for (shm::Word i = 0; i < concerned.count; ++i) {
    send_pages(*output.client, concerned[i], table, told);
  }
  const auto connections = table.connections_of_source(output.source->id);
  for (shm::Word i = 0; i < connections.count; ++i) {
    send_pages(*output.client, table.rule(connections[i]).port, table, told);
  }
}

void Switchboard::send_pages(Client& client, shm::PortId port, const shm::TableView& table,
                             Told& told) {
  const auto send = [&](shm::SourceId id) {
    const Source* source = names_.source_by_id(id);
    if (source != nullptr && send_page(client, *source)) told.insert(&client);
  };
  const auto read = table.sources_read(port);
  for (shm::Word i = 0; i < read.count; ++i) send(read[i]);
  const auto range = table.connections_to(port);
  for (auto index = range.first; index != range.first + range.count; ++index) {
    send(table.rule(index).source);
  }
}

// The page in force, and the next one where there is one. False: the client has them, or nobody has
// yet.
bool Switchboard::send_page(Client& client, const Source& source) {
  if (!source.has_page()) return false;
  shm::PageNumber& shown = client.pages[source.id];
  const auto send = [&](const Page& page, shm::PageNumber number) {
    if (!page || shown >= number) return false;
    shown = number;
    auto message = message_to(wire::MessageKind::kSourcePage, 0, 0, source.id);
    message.value = number;
    message.set_name(source.name);
    client.send(message, {page.readable.get(), -1});
    return true;
  };
  const bool is_new = send(source.page, source.page_number);
  return send(source.next, source.page_number + 1) || is_new;
}

Switchboard::Told Switchboard::show_next_page(const Source& source) {
  Told told;
  const auto show = [&](Client& client) {
    if (client.pages.count(source.id) != 0 && send_page(client, source)) told.insert(&client);
  };
  for (const auto& [instance, output] : outputs_) show(*output->client);
  for (const auto& [instance, input] : inputs_) show(*input->client);
  return told;
}

bool Switchboard::show_news(Client& client, std::uint64_t& told, int& left) {
  const auto& news = names_.news();
  for (auto next = news.upper_bound(told); next != news.end(); ++next) {
    if (client.has_queue() || client.is_lost()) return false;
    if (left == 0) return true;
    --left;
    told = next->first;
    if (next->second.is_source) {
      send_page(client, *names_.source_by_id(next->second.id));
      continue;
    }
    auto message = message_to(wire::MessageKind::kPortName, 0, 0, next->second.id);
    message.set_name(names_.input_by_id(next->second.id)->name);
    client.send(message);
  }
  told = names_.last_news();
  return false;
}

}  // namespace arbiter::service
