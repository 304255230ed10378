;;; session.el --- Works in Emacs as its user would -*- lexical-binding: t -*-

;; With the settings of docs/editor.md and the real language server, `matterixc' on the path:
;;   emacs --batch -q -f package-initialize --load editors/emacs/session.el
;; Emacs 29 has Eglot, Emacs 28 needs its package.  Ends with status 1 and says what was otherwise than it should.

(require 'cl-lib)
(require 'eglot)
(require 'flymake)
(require 'xref)

(defconst session-root (expand-file-name "../.." (file-name-directory load-file-name)))
(defconst session-folder (file-name-as-directory (make-temp-file "mtx" t)))
;; How long an answer may take on a machine that does other work besides, s.
(defconst session-patience 60)

(defun session-expect (holds what &optional seen)
  "Say WHAT is so if it HOLDS, else end with what was SEEN."
  (unless holds
    (message "not so: %s\n%S" what seen)
    (kill-emacs 1))
  (message "ok: %s" what))

(defmacro session-wait (what holds &optional seen)
  "Wait until HOLDS, which is WHAT; say SEEN where it never does."
  `(let ((end (+ (float-time) session-patience)) done)
     (while (not (or (setq done ,holds) (> (float-time) end)))
       (accept-process-output nil 0.05)
       (sit-for 0.01))
     (session-expect done ,what ,seen)))

(defun session-write (name &rest lines)
  "Write LINES to the file NAME."
  (let ((path (expand-file-name name session-folder)))
    (with-temp-file path
      (set-buffer-file-coding-system 'utf-8-unix)
      (insert (mapconcat #'identity lines "\n") "\n"))
    path))

(defun session-go (text)
  "Go to TEXT."
  (goto-char (point-min))
  (search-forward text)
  (goto-char (match-beginning 0)))

(defun session-replace (old new)
  "Type NEW over OLD."
  (session-go old)
  (delete-char (length old))
  (insert new)
  (eglot--signal-textDocument/didChange))

(defun session-has (text)
  "Whether TEXT stands in this buffer."
  (save-excursion (goto-char (point-min)) (search-forward text nil t)))

(defun session-serious ()
  "What is found that is more than a hint."
  (flymake-start)
  (cl-remove-if (lambda (d) (memq (flymake-diagnostic-type d) '(eglot-note :note))) (flymake-diagnostics)))

(defun session-ask (method)
  "What the server answers to METHOD here."
  (jsonrpc-request (eglot-current-server) method (eglot--TextDocumentPositionParams)))

(let ((page (with-temp-buffer (insert-file-contents (expand-file-name "docs/editor.md" session-root)) (buffer-string))))
  (session-expect (string-match "\\*\\*Emacs\\*\\*\\(?:.\\|\n\\)*?```elisp\n\\(\\(?:.\\|\n\\)*?\\)```" page)
                  "docs/editor.md says how Emacs is set up")
  (with-temp-buffer
    (insert (match-string 1 page))
    (eval-buffer)))
(setq eglot-sync-connect session-patience
      eglot-confirm-server-initiated-edits nil
      eglot-autoshutdown nil)

(defconst session-part
  (session-write "part.mtx" "mtx 1" "" "use std::heating" "" "/// How warm." "const warm = 40 degC"))
(defconst session-main
  (session-write "main.mtx"
                 "mtx 1" "" "use part" "use std::heating" "use std::glassware" "" "/// µ°🧪 before names" ""
                 "lab bench {" "    ambient: 25 degC" "    plate = IkaRetControl"
                 "    cup = Beaker250mL on plate holding 100 g of water" "}" ""
                 "workflow heating in bench {" "    heat plate to warm" "    wait 5 min" "    stop heating plate" "}"))

(find-file session-main)
(session-expect (eq major-mode 'mtx-mode) "the file is known by its name" major-mode)
;; Where nobody types, no command ends, after which Eglot would begin.
(run-hooks 'post-command-hook)
(session-wait "the server is attached" (eglot-current-server))

(session-replace "5 min" "5 mg")
(session-wait "a wrong unit is found" (= 1 (length (session-serious))) (flymake-diagnostics))
(session-expect (= (line-number-at-pos (flymake-diagnostic-beg (car (session-serious))))
                   (save-excursion (session-go "5 mg") (line-number-at-pos)))
                "it stands in its line")
(session-replace "5 mg" "5 min")
(session-wait "it is gone once it is mended" (null (session-serious)) (flymake-diagnostics))

(session-go "stop heating")
(session-expect (string-match-p "plate" (format "%S" (session-ask :textDocument/hover))) "hover says what is known")

(session-go "warm")
(call-interactively #'xref-find-definitions)
(session-expect (string-suffix-p "part.mtx" (buffer-file-name)) "a definition is gone to" (buffer-file-name))
(find-file session-main)
(session-go "IkaRetControl")
(call-interactively #'xref-find-definitions)
(session-expect (session-has "asset IkaRetControl") "the library is opened" (buffer-file-name))
(find-file session-main)

(session-go "warm")
(eglot-rename "cosy")
(session-expect (session-has "to cosy") "the name is new here" (buffer-string))
(with-current-buffer (find-file-noselect session-part)
  (session-expect (session-has "const cosy") "it is new in the other file" (buffer-string))
  (eglot--signal-textDocument/didChange))
(eglot--signal-textDocument/didChange)
(session-wait "nothing is wrong after it" (null (session-serious)) (flymake-diagnostics))

(session-replace "    wait 5 min" "    wait 5 min\n    hea")
(pcase-let ((`(,from ,to ,table . ,_) (eglot-completion-at-point)))
  (let ((offered (all-completions (buffer-substring from to) table)))
    (session-expect (cl-some (lambda (word) (string-prefix-p "heat" word)) offered) "`heat' is offered" offered)))
(session-replace "\n    hea\n" "\n")
(session-wait "nothing is wrong again" (null (session-serious)) (flymake-diagnostics))

(session-replace "    wait 5 min" "  wait   5 min")
(eglot-format-buffer)
(session-expect (session-has "\n    wait 5 min\n") "the text has its style" (buffer-string))

(session-replace "heat plate" "haet plate")
(session-wait "a misspelt verb is found" (session-serious) (flymake-diagnostics))
(session-go "haet")
(cl-letf (((symbol-function 'completing-read) (lambda (_ all &rest _) (car (all-completions "" all)))))
  (eglot-code-actions (point) (+ (point) 4) "quickfix" t))
(eglot--signal-textDocument/didChange)
(session-wait "its correction is made" (session-has "heat plate") (buffer-string))
(session-wait "nothing is wrong at last" (null (session-serious)) (flymake-diagnostics))

(session-expect (> (length (session-ask :textDocument/documentSymbol)) 1) "the outline has its items")
(let ((server (eglot-current-server)))
  (eglot-shutdown server nil session-patience)
  (session-wait "the server ends" (not (jsonrpc-running-p server))))
(delete-directory session-folder t)
(kill-emacs 0)
;;; session.el ends here
