// Which daemons there are: for messages where the one that was asked for does not answer.
#pragma once

#include <string>
#include <vector>

namespace arbiter::wire {

// Instances whose daemon listens where this client would look: the first few, in the order of the
// directories.
std::vector<std::string> listening_instances();

// "; these instances run: one, two", and empty where none does.
std::string describe_listening_instances();

// "arbiterd (pid 42) of instance "x"": the one at the other end of this socket.
std::string describe_daemon(int socket, const std::string& instance);

// Why the one at the other end of this socket says nothing, and what to do: "it is stopped; run:
// kill -CONT 42", or, as far as can be seen from here, "it is stopped, or busy".
std::string describe_silence(int socket);

}  // namespace arbiter::wire
