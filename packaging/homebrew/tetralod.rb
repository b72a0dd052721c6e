# A formula for Homebrew. `cargo xtask release` fills in what is in braces, and checks it.
class Tetralod < Formula
  desc "Shows results of simulations with millions of tetrahedra in a web page"
  homepage "{address}"
  url "{address}/releases/download/v{version}/tetralod-{version}.tar.gz"
  sha256 "{sha256}"
  license any_of: ["MIT", "Apache-2.0"]

  depends_on "node" => :build
  depends_on "rustup" => :build

  def install
    system "cargo", "xtask", "build"
    system "cargo", "install", "--features", "page", *std_cargo_args(path: "cli")
    generate_completions_from_executable(bin/"tetralod", "completions")
    man1.mkpath
    system bin/"tetralod", "completions", "--man", man1
  end

  test do
    system bin/"tetralod", "generate", "bucky", "--size", "9", "-o", "bucky.vti"
    system bin/"tetralod", "build", "bucky.vti", "-o", "bucky.mt"
    assert_match "every promise is kept", shell_output("#{bin}/tetralod verify bucky.mt --against bucky.vti")
  end
end
