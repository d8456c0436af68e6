#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Opens a page in headless Chromium, runs scripts in it, takes screenshots; prints JSON.

  browser.py PAGE.html [--size 1440x900] [--scheme dark|light] [--touch] [--hash cpu]
             [--run SCRIPT.js]... [--shot FILE.png]

Speaks the DevTools protocol through a pipe. A script is the body of an async function; scripts and
screenshots happen in the order given. The output holds what scripts returned, what the console and
the log said, and every request beside the page itself. Exit code 3: there is no Chromium.
"""
import argparse
import base64
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

FLAGS = ['--headless', '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
         '--disable-component-update', '--disable-sync', '--disable-extensions', '--use-gl=angle',
         '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--hide-scrollbars', '--force-color-profile=srgb',
         '--remote-debugging-pipe']


def chromium():
    for name in ('chromium', 'chromium-browser', 'google-chrome'):
        if shutil.which(name):
            return shutil.which(name)
    return None


class Browser:
    """A browser and one page of it."""

    def __init__(self, program):
        self.folder = tempfile.mkdtemp(prefix='velatura-browser-')
        self.read_end, child_writes = os.pipe()
        child_reads, self.write_end = os.pipe()

        def give_pipes():
            # The protocol reads from 3 and writes to 4; the pipes may have these numbers already
            reads, writes = os.dup(child_reads), os.dup(child_writes)
            os.dup2(reads, 3)
            os.dup2(writes, 4)

        self.process = subprocess.Popen([program, *FLAGS, '--user-data-dir=' + self.folder, 'about:blank'],
                                        close_fds=False, preexec_fn=give_pipes, stdin=subprocess.DEVNULL,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(child_reads)
        os.close(child_writes)
        self.buffer = b''
        self.number = 0
        self.session = None
        self.console, self.requests = [], []

    def message(self):
        while b'\0' not in self.buffer:
            data = os.read(self.read_end, 1 << 20)
            if not data:
                raise RuntimeError('the browser ended')
            self.buffer += data
        one, self.buffer = self.buffer.split(b'\0', 1)
        return json.loads(one)

    def call(self, method, **params):
        self.number += 1
        request = {'id': self.number, 'method': method, 'params': params}
        if self.session:
            request['sessionId'] = self.session
        data = json.dumps(request).encode() + b'\0'
        while data:
            data = data[os.write(self.write_end, data):]
        while True:
            answer = self.message()
            if answer.get('id') == self.number:
                if 'error' in answer:
                    raise RuntimeError(f'{method}: {answer["error"]["message"]}')
                return answer['result']
            self.note(answer.get('method'), answer.get('params', {}))

    def note(self, method, params):
        if method == 'Runtime.consoleAPICalled':
            self.console.append(params['type'] + ': ' + ' '.join(str(a.get('value', a.get('description'))) for a in params['args']))
        elif method == 'Runtime.exceptionThrown':
            details = params['exceptionDetails']
            self.console.append('exception: ' + details.get('exception', {}).get('description', details['text']))
        elif method == 'Log.entryAdded':
            self.console.append(params['entry']['level'] + ': ' + params['entry']['text'])
        elif method == 'Network.requestWillBeSent':
            self.requests.append(params['request']['url'])

    def open(self, url, width, height, scheme, is_touch):
        target = self.call('Target.createTarget', url='about:blank')['targetId']
        self.session = self.call('Target.attachToTarget', targetId=target, flatten=True)['sessionId']
        for domain in ('Page', 'Runtime', 'Network', 'Log'):
            self.call(domain + '.enable')
        self.call('Emulation.setDeviceMetricsOverride', width=width, height=height, deviceScaleFactor=2 if is_touch else 1,
                  mobile=is_touch)
        if is_touch:
            self.call('Emulation.setTouchEmulationEnabled', enabled=True)
        self.call('Emulation.setEmulatedMedia', features=[{'name': 'prefers-color-scheme', 'value': scheme}])
        self.call('Page.navigate', url=url)

    def run(self, body):
        result = self.call('Runtime.evaluate', expression='(async () => {' + body + '\n})()', awaitPromise=True, returnByValue=True)
        if 'exceptionDetails' in result:
            details = result['exceptionDetails']
            raise RuntimeError('script: ' + details.get('exception', {}).get('description', details['text']))
        return result['result'].get('value')

    def wait_for_page(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            state = self.run('const root = document.documentElement; return root && root.dataset.ready || '
                             '(document.querySelector(".fault[role=alert]") || {}).textContent')
            if state:
                return state
            time.sleep(0.05)
        raise RuntimeError('the page does not become ready: ' + '; '.join(self.console))

    def close(self):
        try:
            self.session = None
            self.call('Browser.close')
        except (RuntimeError, OSError):
            pass
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


class InOrder(argparse.Action):
    def __call__(self, parser, namespace, value, option=None):
        namespace.steps = (getattr(namespace, 'steps', None) or []) + [(self.dest, value)]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('page')
    parser.add_argument('--size', default='1440x900')
    parser.add_argument('--scheme', default='dark')
    parser.add_argument('--hash', default='')
    parser.add_argument('--touch', action='store_true')
    parser.add_argument('--run', action=InOrder)
    parser.add_argument('--shot', action=InOrder)
    options = parser.parse_args()
    program = chromium()
    if not program:
        print('no Chromium on this machine', file=sys.stderr)
        return 3
    url = pathlib.Path(options.page).resolve().as_uri() + ('#' + options.hash if options.hash else '')
    width, height = (int(side) for side in options.size.split('x'))
    browser = Browser(program)
    results = []
    try:
        started = time.monotonic()
        browser.open(url, width, height, options.scheme, options.touch)
        state = browser.wait_for_page(120)
        seconds = time.monotonic() - started
        for kind, value in getattr(options, 'steps', None) or []:
            if kind == 'run':
                results.append(browser.run(pathlib.Path(value).read_text()))
            else:
                browser.run('await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))')
                image = browser.call('Page.captureScreenshot', format='png')['data']
                pathlib.Path(value).write_bytes(base64.b64decode(image))
    finally:
        browser.close()
    page = url.split('#')[0]
    print(json.dumps({'state': state, 'seconds': round(seconds, 2), 'results': results, 'console': browser.console,
                      'requests': [r for r in browser.requests if r.split('#')[0] != page]}))
    return 0


if __name__ == '__main__':
    sys.exit(main())
