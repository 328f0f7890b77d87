"""A browser, an app on env-3 and its page, for anyone who asks for them."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Any

import pytest
from page_browser import CHROMIUM, SOON, app


@pytest.fixture(autouse=True)
def log() -> Iterator[None]:
    """Anyone who starts an app in this process has its log written where a later test cannot write."""
    log = logging.getLogger("lampyris.app")
    handlers, propagate, level = log.handlers[:], log.propagate, log.level
    yield
    log.handlers[:], log.propagate = handlers, propagate
    log.setLevel(level)


@pytest.fixture(scope="session")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Of the app that all tests of a worker share; who changes what others see starts one of its own."""
    with app(tmp_path_factory.mktemp("home"), "env-3") as found:
        yield found


@pytest.fixture(scope="session")
def shared_library(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of another app on env-3, for tests that put maps into its library; each under names of its own."""
    with app(tmp_path_factory.mktemp("home"), "env-3") as found:
        yield found


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium, without a window; one for all tests of a worker, each of which has contexts of its own."""
    driver = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with driver.sync_playwright() as started:
        made = started.chromium.launch(
            executable_path=CHROMIUM, args=["--headless=new", "--no-sandbox", "--disable-gpu"]
        )
        anew = made.new_context

        def patient(**settings: Any) -> Any:
            context = anew(**settings)
            context.set_default_timeout(SOON)
            return context

        made.new_context = patient
        yield made
        made.close()


@pytest.fixture
def wrong() -> list[str]:
    """What the page complains of. A test that asks for what is refused takes that out."""
    return []


@pytest.fixture
def page(browser: Any, address: str, wrong: list[str]) -> Iterator[Any]:
    """The page in a browser that was never here; whatever it complains of fails the test."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    tab = context.new_page()
    tab.on("pageerror", lambda fault: wrong.append(str(fault)))
    tab.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    tab.wait_for_selector("#status >> text=found")
    yield tab
    context.close()
    assert not wrong
