#include "service/clients/replies.hpp"

#include <fcntl.h>
#include <unistd.h>

#include "shm/segment.hpp"

namespace arbiter::service {

void refuse(Client& client, std::uint64_t request, const std::string& why) {
  auto reply = reply_to(request, wire::MessageKind::kRefused);
  reply.set_text(why);
  client.send(reply);
}

shm::FileDescriptor make_document(const std::string& document) {
  const auto file = shm::make_segment("arbiter-document", document.size());
  if (pwrite(file.get(), document.data(), document.size(), 0) !=
      static_cast<ssize_t>(document.size())) {
    throw std::runtime_error("the document could not be written");
  }
  return shm::reopen(file, O_RDONLY);
}

void send_document(Client& client, std::uint64_t request, wire::MessageKind kind,
                   const std::string& document) {
  client.send(reply_to(request, kind), {make_document(document).get(), -1});
}

}  // namespace arbiter::service
