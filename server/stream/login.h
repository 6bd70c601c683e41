#pragma once
// Authentication by a listener's token: programs send it with each request (Authorization: Bearer TOKEN), persons once,
// on the page /login, for a session cookie. Times are the caller's: seconds of a monotonic clock.
#include <deque>
#include <string>
#include <string_view>
#include <utility>

namespace lumigraft::server {

class Login {
 public:
  /// `token` empty: every request is authorized.
  explicit Login(std::string token) : token_(std::move(token)) {}

  bool required() const { return !token_.empty(); }
  /// Whether a request with these headers, empty where it has none, has the token or a session. Compares in constant
  /// time. Wrong tokens count as attempts of `remote`.
  bool authorized(std::string_view authorization, std::string_view cookies, std::string_view remote, double now_s);

  enum class Answer { accepted, wrong, too_many_attempts };
  /// `form`: the body of the page's form. Accepted: `cookie` is the value of the cookie.
  Answer log_in(std::string_view form, std::string_view remote, double now_s, std::string& cookie);

  static constexpr const char* kCookie = "lumigraft_session";

 private:
  bool is_token(std::string_view text) const;
  bool tries_too_often(std::string_view remote, double now_s);

  struct Session {
    std::string id;
    double until_s;
  };
  struct Attempt {
    std::string remote;
    double at_s;
  };
  std::string token_;
  std::deque<Session> sessions_;  ///< oldest first
  std::deque<Attempt> attempts_;  ///< that failed, oldest first
};

}  // namespace lumigraft::server
