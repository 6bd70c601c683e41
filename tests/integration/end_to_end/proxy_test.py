#!/usr/bin/env python3
"""A real Chromium opens the page through real proxies with the configurations of configs/, over https.

  proxy_test.py PROGRAM RECORDING CONFIGS

Checks that pictures arrive over the websocket, as H.264, which browsers decode in secure contexts only; that a listener
that may only view has no controls; and that a token is asked for.
"""
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

from browser_page import Page, free_port
from child_process import interrupt, start

PROGRAM, RECORDING, CONFIGS = (os.path.abspath(p) for p in sys.argv[1:4])
TOKEN = "0123456789abcdef0123456789abcdef"
OTHER_TOKEN = "fedcba9876543210fedcba9876543210"


def config_for(name, replaced):
    """A configuration as it is shipped, with the names and places of this test."""
    with open(os.path.join(CONFIGS, name)) as f:
        text = f.read()
    for shipped, ours in replaced.items():
        assert shipped in text, f"{name} has no {shipped}"
        text = text.replace(shipped, ours)
    return text


class ProxyTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="lumigraft-proxy-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        os.chmod(cls.folder, 0o755)
        cls.certificate, cls.key = (os.path.join(cls.folder, name) for name in ("page.crt", "page.key"))
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "90", "-subj", "/CN=localhost",
                        "-addext", "subjectAltName=DNS:localhost", "-keyout", cls.key, "-out", cls.certificate], check=True, capture_output=True)
        cls.socket = os.path.join(cls.folder, "page.sock")
        cls.plain, cls.own, cls.caddy, cls.nginx = (free_port() for _ in range(4))
        with open(os.path.join(cls.folder, "token"), "w") as f:
            f.write(TOKEN + "\n")
        with open(os.path.join(cls.folder, "kiosk.toml"), "w") as f:
            f.write(f"""session = "{RECORDING}"
[plan]
method = "rays"
trace_scale = 8
[[server.listener]]
listen = "127.0.0.1:{cls.plain}"
permissions = ["view"]
allowed_hosts = ["localhost"]
[[server.listener]]
listen = "unix:{cls.socket}"
permissions = ["view", "control"]
[[server.listener]]
listen = "127.0.0.1:{cls.own}"
certificate = "page.crt"
key = "page.key"
token_file = "token"
""")
        cls.service = start([PROGRAM, "serve", "--config", os.path.join(cls.folder, "kiosk.toml")])
        cls.addClassCleanup(interrupt, cls.service)
        cls.page = Page(os.path.join(cls.folder, "profile"), ["--ignore-certificate-errors"])
        cls.addClassCleanup(cls.page.driver.quit)

    def open(self, port):
        def opened():
            try:
                self.page.driver.get(f"https://localhost:{port}/")
                return "lumigraft" in self.page.driver.title
            except Exception:  # the service or the proxy is not there yet
                return False

        self.page.wait(opened, f"the page at port {port}")

    def expect_pictures(self):
        self.page.wait(lambda: self.page.pictures() >= 5, "pictures")
        self.assertEqual(self.page.data("codec"), "h264")

    def shown(self, element):
        return self.page.driver.find_element("id", element).is_displayed()

    def test_1_caddy_before_a_unix_socket(self):
        site = {"museum.example {": f"localhost:{self.caddy} {{\n\ttls {self.certificate} {self.key}", "/run/lumigraft/page.sock": self.socket}
        path = os.path.join(self.folder, "Caddyfile")
        with open(path, "w") as f:
            f.write("{\n\tadmin off\n\tauto_https off\n}\n" + config_for("Caddyfile", site))
        caddy = start(["caddy", "run", "--config", path, "--adapter", "caddyfile"], env={**os.environ, "HOME": self.folder})
        self.addCleanup(interrupt, caddy)
        self.open(self.caddy)
        self.expect_pictures()
        self.assertTrue(self.shown("object-panel"))
        self.page.click("visible")
        self.page.wait(lambda: self.page.data("grafted") == "false", "the object to be hidden")
        self.page.click("visible")

    def test_2_nginx_before_loopback(self):
        site = {"listen 443 ssl": f"listen {self.nginx} ssl", "museum.example;": "localhost;", "/etc/ssl/museum.example.crt": self.certificate,
                "/etc/ssl/museum.example.key": self.key, "http://127.0.0.1:8080": f"http://127.0.0.1:{self.plain}"}
        path = os.path.join(self.folder, "nginx.conf")
        temporary = "".join(f"    {kind}_temp_path {self.folder}/{kind};\n" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
        with open(path, "w") as f:
            f.write(f"daemon off;\npid {self.folder}/nginx.pid;\nerror_log stderr;\nevents {{}}\nhttp {{\n    access_log off;\n{temporary}" +
                    config_for("nginx.conf", site) + "}\n")
        nginx = start(["/usr/sbin/nginx", "-c", path])
        self.addCleanup(interrupt, nginx)
        self.open(self.nginx)
        self.expect_pictures()
        self.assertFalse(self.shown("object-panel"), "this listener may only view")
        self.assertFalse(self.shown("playback"))

    def test_3_own_certificate_and_token(self):
        self.open(self.own)
        self.assertIn("log in", self.page.driver.title)
        pressed = "return document.querySelector('[data-language=en]').ariaPressed"
        self.page.wait(lambda: self.page.driver.execute_script(pressed) == "true", "the form's texts, which need no token")
        field = self.page.driver.find_element("name", "token")
        field.send_keys("guess")
        field.submit()
        self.page.wait(lambda: "wrong" in self.page.driver.current_url, "the refusal")
        field = self.page.driver.find_element("name", "token")
        field.send_keys(TOKEN)
        field.submit()
        self.page.wait(lambda: self.page.driver.title == "lumigraft", "the page")
        self.expect_pictures()
        self.assertTrue(self.shown("object-panel"))

        # Another token: the page asks for it by itself.
        with open(os.path.join(self.folder, "token"), "w") as f:
            f.write(OTHER_TOKEN + "\n")
        self.service.send_signal(signal.SIGHUP)
        self.page.wait(lambda: "log in" in self.page.driver.title, "to be asked for the token")
        field = self.page.driver.find_element("name", "token")
        field.send_keys(OTHER_TOKEN)
        field.submit()
        self.page.wait(lambda: self.page.driver.title == "lumigraft", "the page")
        self.expect_pictures()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
