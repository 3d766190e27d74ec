//! What goes on, on stderr: a bar for each stage, and Ctrl-C.

use geometry::Rgb;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use raytrace::{Progress, tonemap};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Bars on stderr with the time left; silent where stderr is no terminal, or on request.
#[derive(Debug)]
pub struct Bars {
    bar: Mutex<ProgressBar>,
    shown: bool,
    quiet: bool,
    stop: Arc<AtomicBool>,
    preview: Mutex<Option<Preview>>,
}

/// A picture to look at while it gets better.
#[derive(Debug)]
struct Preview {
    path: PathBuf,
    /// EV; automatic if absent.
    exposure: Option<f32>,
    /// When it was written last.
    written: Option<Instant>,
}

/// A preview is not written more often than this.
const PREVIEW_EVERY: Duration = Duration::from_secs(2);

impl Bars {
    /// `quiet`: no bars, no notes.
    pub fn new(quiet: bool) -> Bars {
        use std::io::IsTerminal;
        Bars {
            bar: Mutex::new(ProgressBar::hidden()),
            shown: !quiet && std::io::stderr().is_terminal(),
            quiet,
            stop: Arc::default(),
            preview: Mutex::default(),
        }
    }

    /// From now on the first Ctrl-C asks the render to end with what it has, the second ends the process.
    pub fn listen_for_interrupts(&self) {
        let stop = Arc::clone(&self.stop);
        let handler = move || {
            if stop.swap(true, Ordering::Relaxed) {
                // 128 + SIGINT, as shells report it.
                std::process::exit(130);
            }
            eprintln!("\nstopping: saving what there is (Ctrl-C again quits at once)");
        };
        // Without a handler Ctrl-C ends the process as ever, so a failure to set it is no reason to fail.
        let _ = ctrlc::set_handler(handler);
    }

    /// From now on Ctrl-C ends the process with the words that are true then: for work that is kept as it goes.
    pub fn end_at_interrupts(&self, words: impl Fn() -> &'static str + Send + 'static) {
        let _ = ctrlc::set_handler(move || {
            eprintln!("\n{}", words());
            std::process::exit(130);
        });
    }

    /// Whether the user asked to stop.
    pub fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// One line on stderr, above the bar, unless quiet.
    pub fn note(&self, text: &str) {
        if !self.quiet {
            self.with(|bar| bar.suspend(|| eprintln!("{text}")));
        }
    }

    /// From now on writes the picture as far as it is done to `path`, every few seconds; with `None` no more, and the last
    /// one goes.
    pub fn show_in(&self, path: Option<PathBuf>, exposure: Option<f32>) {
        let mut preview = self.preview.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(old) = preview.take().filter(|old| old.written.is_some()) {
            // It may have been moved away by whoever looks at it.
            let _ = std::fs::remove_file(old.path);
        }
        *preview = path.map(|path| Preview { path, exposure, written: None });
    }

    /// Ends the last stage.
    pub fn done(&self) {
        self.with(|bar| bar.finish_and_clear());
    }

    fn with<T>(&self, f: impl FnOnce(&mut ProgressBar) -> T) -> T {
        // A thread that panicked while drawing leaves a bar that is still good enough.
        f(&mut self.bar.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Progress for Bars {
    /// A stage of unknown length has `total` 0.
    fn stage(&self, name: &'static str, total: u64) {
        if !self.shown {
            return;
        }
        let template = match total {
            0 => "{msg:>10} {spinner} {elapsed}",
            _ => "{msg:>10} [{bar:40}] {percent:>3} %  {elapsed}, {eta} left",
        };
        // The templates are ours; were one wrong, indicatif's default does.
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let next = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(10))
            .with_style(style.progress_chars("=> "))
            .with_message(name);
        next.enable_steady_tick(Duration::from_millis(200));
        self.with(|bar| {
            bar.finish_and_clear();
            *bar = next;
        });
    }

    fn advance(&self, n: u64) {
        if self.shown {
            self.with(|bar| bar.inc(n));
        }
    }

    fn stopped(&self) -> bool {
        self.interrupted()
    }

    fn picture(&self, width: u32, height: u32, pixels: &dyn Fn() -> Vec<Rgb>) {
        let mut preview = self.preview.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(preview) = &mut *preview else { return };
        if preview.written.is_some_and(|at| at.elapsed() < PREVIEW_EVERY) {
            return;
        }
        let pixels = pixels();
        let ev = preview.exposure.unwrap_or_else(|| tonemap::automatic_exposure(&pixels));
        // What cannot be written now is told of when the whole picture is.
        let _ = tonemap::write_png(width, height, &tonemap::to_srgb(&pixels, ev), &preview.path);
        preview.written = Some(Instant::now());
    }
}
